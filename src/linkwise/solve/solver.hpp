#pragma once
// What every linear solver offers: options in, one solve of A x = b on a block tree, a Report out.

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "linkwise/base/outcome.hpp"
#include "linkwise/exec/executor.hpp"
#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

/// When an iteration stops. See stop_test.hpp.
enum class StopRule {
  paper,        ///< ||x+ - x|| / ||x+|| <= tolerance [sharf1993, section 5]
  residual,     ///< ||b - A x|| / ||b|| <= tolerance
  energy_norm,  ///< estimate of ||x* - x||_A <= tolerance ||x*||_A + absolute_tolerance
};

std::string_view to_string(StopRule rule);
/// InputError, listing the known names, when the name is unknown.
StopRule stop_rule_from_name(std::string_view name);

/// The two equivalent recurrences of conjugate gradients.
enum class ConjugateGradientForm {
  two_term,    ///< the usual one
  three_term,  ///< the paper's Table 1
};

std::string_view to_string(ConjugateGradientForm form);
ConjugateGradientForm conjugate_gradient_form_from_name(std::string_view name);

/// How successive over-relaxation gets its factor.
enum class RelaxationChoice {
  optimal,   ///< 2 / (1 + sqrt(1 - mu^2)), mu = spectral radius of 1 - D^-1 A
  given,     ///< SolverOptions::omega
  adaptive,  ///< found on the way [hageman1981, chapter 9]
};

std::string_view to_string(RelaxationChoice choice);
RelaxationChoice relaxation_choice_from_name(std::string_view name);

/// What the energy-norm rule allows: ||x* - x||_A <= relative ||x*||_A + absolute.
struct EnergyBound {
  double relative = 0.0;
  double absolute = 0.0;  ///< in the units of sqrt(x^T A x)
};

struct SolverOptions {
  /// Relative tolerance of the stop rule. A simulation passes a tenth of its own tolerance, as the
  /// paper and SUNDIALS do. Direct solvers ignore it.
  double tolerance = 1e-7;
  /// Added to the energy-norm rule's bound, in the units of sqrt(x^T A x): for constraint forces
  /// the square root of (twice the kinetic energy of an acceleration).
  double absolute_tolerance = 0.0;
  /// Where given, the energy-norm rule reads it at every solve instead of the two tolerances: what
  /// an integrator's error weights allow changes from step to step.
  std::shared_ptr<const EnergyBound> energy_bound;
  /// 0: chosen by the solver from the number of unknowns.
  int max_iterations = 0;
  StopRule stop = StopRule::energy_norm;
  ConjugateGradientForm form = ConjugateGradientForm::two_term;
  RelaxationChoice relaxation = RelaxationChoice::optimal;
  /// Over-relaxation factor in (0, 2); read when relaxation is `given`.
  double omega = 1.0;
  /// Spectral radius of 1 - D^-1 A, in (0, 1), for sor and chebyshev; 0: estimated by Lanczos.
  double spectral_radius = 0.0;
  /// Joints in a block of block_schwarz_conjugate_gradient and two_level; 0: the solver's default.
  int block_size = 0;
  /// Steps of iterative refinement after a direct solve.
  int refinement_steps = 0;
  /// Direct solvers: estimate the error (a product and a further solve); otherwise it is NaN.
  bool estimate_error = false;
  /// lagged_thomas: how many iterations a solve may take before the factor is renewed.
  int lag_limit = 8;
  /// Who shares an iteration's products and sums; it influences no result.
  Executor executor;

  bool operator==(const SolverOptions&) const = default;
};

/// Throws InputError that names the option when one is out of range.
void validate(const SolverOptions& options);

struct Report {
  Outcome outcome = Outcome::converged;
  int iterations = 0;
  /// Estimate of ||x* - x||_A / ||x*||_A; NaN when a direct solver was not asked for it.
  double error_estimate = 0.0;
  /// The node at which a factorisation broke down, or of the largest residual where an iteration
  /// ended without meeting its tolerance, or -1.
  int node = -1;
  bool ok() const { return outcome == Outcome::converged; }
};

/// Adds one solve of several to their common report: the first failure, the sum of the iterations,
/// the largest error.
void accumulate(Report& total, const Report& one);

class LinearSolver {
 public:
  virtual ~LinearSolver() = default;

  /// Solves A x = b. x holds the initial guess on entry (direct solvers ignore it) and the solution
  /// on return. Allocates nothing after the first call with a given structure.
  virtual Report solve(const BlockTree& A, std::span<const double> b, std::span<double> x) = 0;

  /// Solves for `count` right-hand sides stored one after the other; x likewise. Direct solvers
  /// factor once. The report holds the worst outcome and error and the sum of the iterations.
  virtual Report solve_many(const BlockTree& A, int count, std::span<const double> b,
                            std::span<double> x);

  const SolverOptions& options() const { return options_; }

 protected:
  explicit LinearSolver(const SolverOptions& options) : options_(options) {}
  SolverOptions options_;
};

}  // namespace linkwise
