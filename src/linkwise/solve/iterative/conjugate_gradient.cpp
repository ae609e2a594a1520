// Conjugate gradients preconditioned by the block diagonal D (J-CG of [sharf1993], Table 1).
//
// In the coordinates of ScaledTree D is the identity. The three-term form is the paper's,
//     z = D^-1 (b - A f),   g+ = (z, D z) / (z, A z),   rho_1 = 1,
//     rho+ = 1 / (1 - (g+ / g) (z, D z) / (z-, D z-) / rho),
//     f+ = rho+ (g+ z + f) + (1 - rho+) f-,
// with (z, A z) where the printed table has (z, z). Both forms give the same iterates; the two-term
// form needs one vector update less and rounds a little better.

#include <algorithm>

#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/iterative/krylov.hpp"

namespace linkwise {
namespace {

constexpr Option form{.name = "form",
                      .fallback = std::string_view("two_term"),
                      .text = "two_term, or three_term as in Table 1 of [sharf1993]",
                      .choices = "two_term, three_term"};

class ConjugateGradient final : public IterativeSolver {
 public:
  explicit ConjugateGradient(const SolverOptions& options)
      : IterativeSolver(options, Coordinates::block_scaled),
        three_term_(options.own.is(form, "three_term")) {}

 private:
  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override {
    const auto product = [this](std::span<const double> v, std::span<double> w) { multiply(v, w); };
    if (three_term_)
      three_term(b, x, stop);
    else
      conjugate_gradients(
          b, x, stop, work_, product,
          [](std::span<const double> r, std::span<double>) { return r; }, executor());
  }

  void three_term(std::span<const double> b, std::span<double> x, StopTest& stop);

  bool three_term_;
  KrylovVectors work_;
  std::vector<double> previous_, change_;
};

void ConjugateGradient::three_term(std::span<const double> b, std::span<double> x, StopTest& stop) {
  work_.resize(x.size());
  previous_.assign(x.begin(), x.end());
  change_.resize(x.size());
  std::span<double> z = work_.r, z_previous = work_.p, az = work_.q;
  multiply(x, z);
  subtract_from(b, z, executor());
  double known_energy = dot(x, b, executor()) + dot(x, z, executor());
  if (known_energy < 0.0) {
    std::fill(x.begin(), x.end(), 0.0);
    std::copy(b.begin(), b.end(), z.begin());
    known_energy = 0.0;
  }
  stop.set_solution_energy(known_energy);
  double zz = sum_of_squares(z, executor()), zz_previous = 0.0, gamma_previous = 0.0, rho = 1.0,
         share = 1.0;
  const double first_zz = zz;
  if (stop.accepts_start(zz)) return;
  double step = 0.0;
  SmallestRitz ritz;
  for (bool first = true;; first = false) {
    if (zz == 0.0) return stop.stop(Outcome::converged);
    multiply(z, az);
    const double curvature = dot(z, az, executor());
    if (!(curvature > 0.0)) return stop.stop(breakdown(zz, curvature, first_zz));
    const double gamma = zz / curvature;
    rho = first ? 1.0 : 1.0 / (1.0 - gamma / gamma_previous * (zz / zz_previous) / rho);
    // rho gamma is the step length of the two-term form, so that the error estimates agree too.
    const double growth = first ? 0.0 : zz / zz_previous;
    step = rho * gamma;
    const double decrease = step * zz;
    for_each_entry(x.size(), executor(), [&](std::size_t i) {
      const double next = rho * (gamma * z[i] + x[i]) + (1.0 - rho) * previous_[i];
      change_[i] = next - x[i];
      previous_[i] = x[i];
      x[i] = next;
      // The residual obeys the recurrence of the iterate.
      const double residual =
          rho * (z[i] - gamma * az[i]) + (1.0 - rho) * (first ? 0.0 : z_previous[i]);
      z_previous[i] = z[i];
      z[i] = residual;
    });
    ritz.add(step, growth);
    stop.set_smallest_eigenvalue(ritz.value());
    const double energy = known_energy + stop.estimate().total() + decrease;
    zz_previous = zz;
    zz = sum_of_squares(z, executor());
    share /= share + zz / zz_previous;
    const double bound = zz * share / stop.smallest_eigenvalue();
    if (stop.stops({.decrease = decrease,
                    .solution_energy = energy,
                    .squared_bound = bound,
                    .x = x,
                    .change = change_,
                    .residual = z}))
      return;
    gamma_previous = gamma;
  }
}

}  // namespace

std::span<const Option> conjugate_gradient_options() { return {&form, 1}; }

std::unique_ptr<LinearSolver> make_conjugate_gradient(const SolverOptions& options) {
  return std::make_unique<ConjugateGradient>(options);
}

}  // namespace linkwise
