#pragma once

#include <memory>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

std::unique_ptr<Integrator> make_runge_kutta_4(OdeSystem& system, const IntegratorOptions& options);

}  // namespace linkwise
