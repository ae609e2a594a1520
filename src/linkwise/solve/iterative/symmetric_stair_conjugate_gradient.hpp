#pragma once

#include <memory>

#include "linkwise/solve/solver.hpp"

namespace linkwise {

std::unique_ptr<LinearSolver> make_symmetric_stair_conjugate_gradient(const SolverOptions& options);

}  // namespace linkwise
