#pragma once

#include <memory>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

std::unique_ptr<Integrator> make_adams(OdeSystem& system, const IntegratorOptions& options);
std::unique_ptr<Integrator> make_bdf(OdeSystem& system, const IntegratorOptions& options);

}  // namespace linkwise
