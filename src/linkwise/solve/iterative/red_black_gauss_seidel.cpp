// Block Gauss-Seidel, all red nodes at once and then all black ones. Along a chain this is the same
// consistently ordered matrix in another order, with the same asymptotic rate [hageman1981, chapter
// 9] - and fully parallel, although [sharf1993] counts Gauss-Seidel as sequential. Joints of a
// hub need a colour each.

#include "linkwise/solve/iterative/red_black_gauss_seidel.hpp"

#include "linkwise/solve/iterative/relaxation.hpp"

namespace linkwise {
namespace {

class RedBlackGaussSeidel final : public Relaxation {
 public:
  explicit RedBlackGaussSeidel(const SolverOptions& options)
      : Relaxation(options, SweepOrder::by_colour) {}

 private:
  double relaxation_factor(double, double) override { return 1.0; }
};

}  // namespace

std::unique_ptr<LinearSolver> make_red_black_gauss_seidel(const SolverOptions& options) {
  return std::make_unique<RedBlackGaussSeidel>(options);
}

}  // namespace linkwise
