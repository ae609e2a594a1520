#pragma once

#include <memory>

#include "linkwise/integrate/integrator.hpp"

namespace linkwise {

std::unique_ptr<Integrator> make_semi_implicit_euler(OdeSystem& system,
                                                     const IntegratorOptions& options);

}  // namespace linkwise
