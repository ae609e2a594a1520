#pragma once
// What every linear solver offers: options in, one solve of A x = b on a block tree, a Report out.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "linkwise/base/outcome.hpp"
#include "linkwise/exec/executor.hpp"
#include "linkwise/linear/block_tree.hpp"
#include "linkwise/solve/options.hpp"

namespace linkwise {

/// When an iteration stops. See stop_test.hpp.
enum class StopRule {
  paper,        ///< ||x+ - x|| / ||x+|| <= tolerance [sharf1993, section 5]
  residual,     ///< ||b - A x|| / ||b|| <= tolerance
  energy_norm,  ///< estimate of ||x* - x||_A <= tolerance ||x*||_A + absolute_tolerance
};

struct StopRuleEntry {
  std::string_view name, description;
};
/// In the order of the enum.
std::span<const StopRuleEntry> stop_rule_table();
std::string_view to_string(StopRule rule);
/// InputError, listing the known names, when the name is unknown.
StopRule stop_rule_from_name(std::string_view name);

/// What the energy-norm rule allows: ||x* - x||_A <= relative ||x*||_A + absolute.
struct EnergyBound {
  double relative = 0.0;
  double absolute = 0.0;  ///< in the units of sqrt(x^T A x)
};

inline constexpr double usual_tolerance = 1e-7;

struct SolverOptions {
  /// Relative tolerance of the stop rule. A simulation passes a tenth of its own tolerance, as the
  /// paper and SUNDIALS do. Direct solvers ignore it.
  double tolerance = usual_tolerance;
  /// Added to the energy-norm rule's bound, in the units of sqrt(x^T A x): for constraint forces
  /// the square root of (twice the kinetic energy of an acceleration).
  double absolute_tolerance = 0.0;
  /// Where given, the energy-norm rule reads it at every solve instead of the two tolerances: what
  /// an integrator's error weights allow changes from step to step.
  std::shared_ptr<const EnergyBound> energy_bound;
  /// 0: chosen by the solver from the number of unknowns.
  int max_iterations = 0;
  StopRule stop = StopRule::energy_norm;
  /// Options of single solvers, see set().
  OptionValues own;
  /// Who shares an iteration's products and sums; it influences no result.
  Executor executor;

  /// Sets an option by the name that users give it, one of solver_options(). InputError when the
  /// name is unknown, or the value of another type or out of range.
  void set(std::string_view name, OptionValue value);
  bool operator==(const SolverOptions&) const = default;
};

/// Options by the names that users give them.
using SolverOptionValues = std::vector<std::pair<std::string, OptionValue>>;
/// Sets and validates them all.
void set_options(SolverOptions& options, const SolverOptionValues& values);
/// What every solver is told, then further options, which go first.
SolverOptions make_solver_options(double tolerance, std::string_view stop, int max_iterations,
                                  const SolverOptionValues& values);

/// The options that every solver has, by name.
std::span<const Option> common_options();

/// Throws InputError that names the option when one is out of range.
void validate(const SolverOptions& options);

struct Report {
  Outcome outcome = Outcome::converged;
  int iterations = 0;
  /// ||x* - x||_A / ||x*||_A, estimated or bounded; NaN when a direct solver was not asked for it.
  double error_estimate = 0.0;
  /// Is error_estimate an upper bound that knows all modes, up to rounding? See CheckedSolver.
  bool error_is_bound = false;
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
  /// Of later solves, as max_iterations of the options.
  void limit_iterations(int most) { options_.max_iterations = most; }

 protected:
  explicit LinearSolver(const SolverOptions& options) : options_(options) {}
  SolverOptions options_;
};

}  // namespace linkwise
