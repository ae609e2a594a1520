#pragma once

#include <memory>

#include "linkwise/solve/solver.hpp"

namespace linkwise {

std::unique_ptr<LinearSolver> make_gauss_seidel(const SolverOptions& options);

}  // namespace linkwise
