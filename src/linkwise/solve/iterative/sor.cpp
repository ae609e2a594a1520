// Block successive over-relaxation, eqs. (16) and (17) of [sharf1993]:
//     D f+ = omega (b + L f+ + U f) + (1 - omega) D f,
// on A~ = 1 + O node by node, x_i += omega (b_i - (A~ x)_i); Gauss-Seidel is omega = 1. Each local
// step is an exact line search along the block for omega = 1 and lowers the squared A-norm of the
// error by (2 - omega) omega |b_i - (A~ x)_i|^2, whatever the order of the nodes: the stop test
// gets the decrease of a sweep without a product with A.
//
// Order red_black takes all red nodes at once and then all black ones (a colour for each joint of a
// hub). Along a chain this is the same consistently ordered matrix in another order, with the same
// asymptotic rate [hageman1981, chapter 9] - and fully parallel, although [sharf1993] counts
// Gauss-Seidel as sequential.
//
// The factor is given, or optimal for the spectral radius mu of Jacobi's iteration, or adaptive.
//
// Along a chain A is consistently ordered and mu and the radius lambda of the sweep at omega are
// tied by (lambda + omega - 1)^2 = lambda omega^2 mu^2 [hageman1981, chapter 9]; the best omega,
// 2 / (1 + sqrt(1 - mu^2)), makes lambda = omega - 1. A hub breaks the relation. The sweep
// converges for every omega in (0, 2) still, but the more joints a body has, the less
// over-relaxation it takes: with c the largest eigenvalue of D^-1 A, which is below 2 on chains,
// omega - 1 is reduced by 2 / c. Measured on random trees and stars of 16 to 1000 joints that is
// within a factor of 1.5 of the best.

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise {
namespace {

constexpr Option rows[] = {
    {.name = "relaxation",
     .fallback = std::string_view("optimal"),
     .text = "how the factor is found: optimal for the spectral radius, given or adaptive; given "
             "when omega is",
     .choices = "optimal, given, adaptive"},
    {.name = "omega",
     .fallback = 1.0,
     .text = "the factor, in (0, 2)",
     .accepts = [](double x) { return x > 0.0 && x < 2.0; },
     .wanted = "over-relaxation converges for 0 < omega < 2 only"},
    spectral_radius_option,
    {.name = "order",
     .fallback = std::string_view("natural"),
     .text = "natural, base to tip, or red_black, every second node at once",
     .choices = "natural, red_black"},
};
constexpr const Option &relaxation = rows[0], &factor = rows[1], &order = rows[3];

/// The optimal factor of chains, brought down for a larger spectrum.
double reduced(double omega, double largest_eigenvalue) {
  return 1.0 + (omega - 1.0) * std::min(1.0, 2.0 / largest_eigenvalue);
}

class SuccessiveOverRelaxation final : public IterativeSolver {
 public:
  explicit SuccessiveOverRelaxation(const SolverOptions& o)
      : IterativeSolver(o, Coordinates::block_scaled),
        optimal_(o.own.is(relaxation, "optimal") &&
                 (o.own.given(relaxation) || !o.own.given(factor))),
        adaptive_(o.own.is(relaxation, "adaptive")),
        red_black_(o.own.is(order, "red_black")),
        spectral_radius_(o.own.number(spectral_radius_option)),
        omega_(o.own.number(factor)) {}

 private:
  Outcome prepare(const BlockTree& A) override;
  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override;
  int default_max_iterations(int) const override { return 20000; }

  /// One sweep; returns the sum of squares of the changes.
  double sweep(std::span<const double> b, std::span<double> x);
  double adapt(double change, double previous_change);

  bool optimal_, adaptive_, red_black_;
  double spectral_radius_, omega_;
  SpectrumEstimator estimator_;
  double previous_ratio_ = 0.0;
  int sweeps_ = 0;  ///< since omega last changed
  std::vector<int> sequence_, colours_;
  std::vector<double> sums_, change_, residual_;
};

Outcome SuccessiveOverRelaxation::prepare(const BlockTree&) {
  if (optimal_) {
    Spectrum spectrum{1.0 - spectral_radius_, 2.0};
    if (spectral_radius_ == 0.0) spectrum = estimator_.estimate(scaled());
    if (!(spectrum.smallest > 0.0)) return Outcome::not_positive_definite;
    omega_ = reduced(optimal_relaxation(spectrum.smallest), spectrum.largest);
  }
  if (!scaled().structure_changed()) return Outcome::converged;
  sums_.resize(6 * scaled().hubs.size());
  change_.resize(scaled().size());
  residual_.resize(scaled().size());
  sequence_.resize(scaled().n());
  std::iota(sequence_.begin(), sequence_.end(), 0);
  if (red_black_) {
    scaled().colour(colours_);
    std::stable_sort(sequence_.begin(), sequence_.end(),
                     [this](int a, int b) { return colours_[a] < colours_[b]; });
  }
  return Outcome::converged;
}

double SuccessiveOverRelaxation::sweep(std::span<const double> b, std::span<double> x) {
  const ScaledTree& system = scaled();
  const double omega = omega_;
  // Afresh in every sweep, so that rounding in the running sums does not accumulate.
  system.hub_sums(x, sums_);
  const auto relax = [&](int begin, int end) {
    double square = 0.0;
    for (int s = begin; s < end; ++s) {
      const int i = sequence_[s], at = system.offset[i], dim = system.dim[i];
      double row[6];
      for (int k = 0; k < dim; ++k) row[k] = b[at + k] - x[at + k];
      system.add_row(i, x.data(), sums_.data(), row, -1.0);
      for (int k = 0; k < dim; ++k) {
        row[k] *= omega;
        square += row[k] * row[k];
        change_[at + k] = row[k];
        x[at + k] += row[k];
      }
      system.update_sums(i, row, sums_.data());
    }
    return square;
  };
  if (!red_black_) return relax(0, system.n());
  // Nodes of one colour share neither an unknown nor a hub's sum.
  double total = 0.0;
  for (int first = 0, end = 0; first < system.n(); first = end) {
    while (end < system.n() && colours_[sequence_[end]] == colours_[sequence_[first]]) ++end;
    total += Tiles(end - first, TileOf::nodes).sum(executor(), [&](int from, int to) {
      return relax(first + from, first + to);
    });
  }
  return total;
}

void SuccessiveOverRelaxation::iterate(std::span<const double> b, std::span<double> x,
                                       StopTest& stop) {
  double change = 0.0, previous = 0.0;
  if (adaptive_) omega_ = 1.0;
  previous_ratio_ = 0.0;
  sweeps_ = 0;
  while (true) {
    if (adaptive_) omega_ = adapt(change, previous);
    previous = change;
    change = sweep(b, x);
    if (stop.needs_residual()) {
      multiply(x, residual_);
      subtract_from(b, residual_, executor());
    }
    IterationStep step;
    step.decrease = (2.0 - omega_) / omega_ * change;
    step.solution_energy = dot(x, b, executor());
    step.x = x;
    step.change = change_;
    step.residual = residual_;
    if (stop.stops(step)) return;
  }
}

// The adaptive procedure of [hageman1981, chapter 9] in its essentials. While omega is below its
// optimum the changes shrink by the sweep's radius lambda, real and above omega - 1, and lambda
// tells mu, hence a better omega. Two guards: the ratio must have settled, which after a change of
// omega takes until p (omega - 1)^(p - 1) is small; and it must be clearly slower than an optimal
// omega's, ratio > (omega - 1)^0.75, else the ratio is that of complex eigenvalues and tells
// nothing.
double SuccessiveOverRelaxation::adapt(double change, double previous_change) {
  if (!(previous_change > 0.0) || !(change > 0.0)) return omega_;
  ++sweeps_;
  const double ratio = std::sqrt(change / previous_change);
  const double before = previous_ratio_;
  previous_ratio_ = ratio;
  const double at_best = omega_ - 1.0;
  const bool transient = sweeps_ < 4 || sweeps_ * std::pow(at_best, sweeps_ - 1) > 0.1;
  const bool settled = std::abs(ratio - before) < 0.1 * (1.0 - ratio);
  if (transient || !settled || ratio >= 1.0 || ratio <= std::pow(at_best, 0.75)) return omega_;
  const double mu = (ratio + at_best) / (std::sqrt(ratio) * omega_);
  if (!(mu < 1.0)) return omega_;
  const double better = reduced(optimal_relaxation(1.0 - mu), scaled().joints_on_a_body());
  if (better <= omega_) return omega_;
  sweeps_ = 0;
  previous_ratio_ = 0.0;
  return better;
}

std::unique_ptr<LinearSolver> make(SolverOptions options, bool red_black, bool relaxed) {
  options.own.set(order, std::string(red_black ? "red_black" : "natural"));
  if (!relaxed) {
    options.own.set(relaxation, std::string("given"));
    options.own.set(factor, 1.0);
  }
  return std::make_unique<SuccessiveOverRelaxation>(options);
}

}  // namespace

std::span<const Option> sor_options() { return rows; }
std::span<const Option> red_black_sor_options() { return sor_options().first(3); }

std::unique_ptr<LinearSolver> make_sor(const SolverOptions& options) {
  return std::make_unique<SuccessiveOverRelaxation>(options);
}
std::unique_ptr<LinearSolver> make_red_black_sor(const SolverOptions& options) {
  return make(options, true, true);
}
std::unique_ptr<LinearSolver> make_gauss_seidel(const SolverOptions& options) {
  return make(options, false, false);
}
std::unique_ptr<LinearSolver> make_red_black_gauss_seidel(const SolverOptions& options) {
  return make(options, true, false);
}

}  // namespace linkwise
