#pragma once

#include <memory>

#include "linkwise/solve/solver.hpp"

namespace linkwise {

std::unique_ptr<LinearSolver> make_block_schwarz_conjugate_gradient(const SolverOptions& options);

}  // namespace linkwise
