// Chebyshev acceleration of block Jacobi (J-SI of [sharf1993], Table 1):
//     f+ = rho+ (g z + f) + (1 - rho+) f-,   z = D^-1 (b - A f),
//     rho_1 = 1,  rho_2 = 1 / (1 - s^2 / 2),  rho+ = 1 / (1 - s^2 rho / 4).
// With the eigenvalues of D^-1 A in [a, c]: g = 2 / (a + c), s = (c - a) / (c + a) [hageman1981,
// chapter 4]. Along a chain the spectrum is symmetric about 1, so that g = 1 and s is the
// spectral radius of Jacobi's iteration, the paper's form; a hub can have c > 2, where Jacobi
// itself diverges.

#include <algorithm>
#include <cmath>

#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise {
namespace {

class Chebyshev final : public IterativeSolver {
 public:
  explicit Chebyshev(const SolverOptions& options)
      : IterativeSolver(options, Coordinates::block_scaled),
        spectral_radius_(options.own.number(spectral_radius_option)) {}

 private:
  int default_max_iterations(int) const override { return 20000; }

  Outcome prepare(const BlockTree&) override {
    double low = 1.0 - spectral_radius_, high = 1.0 + spectral_radius_;
    if (spectral_radius_ == 0.0) {
      const Spectrum spectrum = estimator_.estimate(scaled());
      low = spectrum.smallest;
      high = spectrum.largest;
    }
    if (!(low > 0.0)) return Outcome::not_positive_definite;
    step_ = 2.0 / (low + high);
    radius_ = (high - low) / (high + low);
    contraction_ = radius_ / (1.0 + std::sqrt(1.0 - radius_ * radius_));
    smallest_ = low;
    return Outcome::converged;
  }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override;
  double calc_squared_error(double change_square);

  double spectral_radius_;  ///< 0: estimated
  SpectrumEstimator estimator_;
  double step_ = 1.0, radius_ = 0.0, contraction_ = 0.0, smallest_ = 1.0;
  double last_changes_[3] = {};
  std::vector<double> previous_, change_, residual_, next_residual_;
};

// The changes shrink by the contraction that the polynomial guarantees, or slower when the spectrum
// was underestimated: what is left is their geometric sum.
double Chebyshev::calc_squared_error(double change_square) {
  const double oldest = last_changes_[2];
  last_changes_[2] = last_changes_[1];
  last_changes_[1] = last_changes_[0];
  last_changes_[0] = change_square;
  // Until a contraction shows, only a change at rounding level is taken for convergence.
  constexpr double unseen_condition = 1e8;
  if (oldest == 0.0) return unseen_condition * change_square;
  const double rate = std::max(contraction_, std::pow(change_square / oldest, 1.0 / 6.0));
  if (!(rate < 1.0)) return unseen_condition * change_square;
  return change_square * rate * rate / ((1.0 - rate) * (1.0 - rate));
}

void Chebyshev::iterate(std::span<const double> b, std::span<double> x, StopTest& stop) {
  previous_.assign(x.begin(), x.end());
  change_.resize(x.size());
  residual_.resize(x.size());
  next_residual_.resize(x.size());
  std::fill(std::begin(last_changes_), std::end(last_changes_), 0.0);
  stop.set_smallest_eigenvalue(smallest_);
  multiply(x, residual_);
  subtract_from(b, residual_, executor());
  double rho = 1.0;
  for (int k = 0;; ++k) {
    if (k == 1) rho = 1.0 / (1.0 - 0.5 * radius_ * radius_);
    if (k > 1) rho = 1.0 / (1.0 - 0.25 * radius_ * radius_ * rho);
    for_each_entry(x.size(), executor(), [&](std::size_t i) {
      const double next = rho * (step_ * residual_[i] + x[i]) + (1.0 - rho) * previous_[i];
      change_[i] = next - x[i];
      previous_[i] = x[i];
      x[i] = next;
    });
    multiply(x, next_residual_);
    subtract_from(b, next_residual_, executor());
    const double with_old = dot(change_, residual_, executor());
    const double with_new = dot(change_, next_residual_, executor());
    residual_.swap(next_residual_);
    IterationStep step;
    step.decrease = with_old + with_new;
    step.solution_energy = dot(x, b, executor());
    step.squared_error = calc_squared_error(std::max(0.0, with_old - with_new));
    step.x = x;
    step.change = change_;
    step.residual = residual_;
    if (stop.stops(step)) return;
  }
}

}  // namespace

std::span<const Option> chebyshev_options() { return {&spectral_radius_option, 1}; }

std::unique_ptr<LinearSolver> make_chebyshev(const SolverOptions& options) {
  return std::make_unique<Chebyshev>(options);
}

}  // namespace linkwise
