// Block over-relaxation, all red nodes at once and then all black ones; see red_black_gauss_seidel.

#include "linkwise/solve/iterative/red_black_sor.hpp"

#include "linkwise/solve/iterative/sor.hpp"

namespace linkwise {

std::unique_ptr<LinearSolver> make_red_black_sor(const SolverOptions& options) {
  return std::make_unique<SuccessiveOverRelaxation>(options, SweepOrder::by_colour);
}

}  // namespace linkwise
