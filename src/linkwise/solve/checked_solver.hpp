#pragma once
// A linear solver whose answers are checked before they are believed.
//
// What an iteration says of its error it infers from what it has met (stop_test.hpp). A mode that
// is slow enough it has not met, and then the estimate is too low by any factor. So an answer is
// held against a bound that knows all modes:
//   1. the caller's, which costs next to nothing (MotionError::gap);
//   2. where that one is too wide, the error itself, ||e||_A^2 = r^T A^-1 r with a factor of A: the
//      work of about five iterations.
// Where the error turns out too large, the iteration goes on, to a tolerance tighter by as much.
// Asked for is one tolerance, believed is what is below `slack` of them: on ordinary machines the
// caller's bound is that much wider than the error.

#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "linkwise/solve/direct/tree_factor.hpp"
#include "linkwise/solve/solver.hpp"

namespace linkwise {

/// Of the accelerations a that a solution x leads to.
struct MotionError {
  /// sqrt(||x* - x||_A^2 + ||a* - a||^2), in one norm: a bound on both errors.
  double gap = 0.0;
  double size = 0.0;  ///< ||a||
};

/// By how much an iteration is to be tighter than was asked for, round after round.
class Strictness {
 public:
  /// How many tolerances an error may have that is believed.
  static constexpr double slack = 10.0;

  explicit Strictness(double first) : value_(first) {}
  /// The factor of the tolerances for the next round.
  double value() const { return value_; }
  int rounds() const { return rounds_; }
  /// After a round whose error was `excess` > slack tolerances; stuck: the iteration itself says
  /// that it gets no further. False where nothing more is to be gained.
  bool tighten(double excess, bool stuck);
  /// Slowly back to what was asked for.
  double relieved() const;

 private:
  double value_, previous_ = 0.0;
  int rounds_ = 0;
};

class CheckedSolver {
 public:
  /// InputError as make_solver(). learns: how much tighter a solve had to be holds for the next one
  /// too, so that the result depends on the solves before.
  CheckedSolver(std::string_view solver, const SolverOptions& options, bool learns);

  /// Called after each solve with the x of that time; size is wanted where the argument is true.
  using Recover = std::function<MotionError(bool)>;
  /// Solves A x = b as a LinearSolver does. Of iterative solvers the error in the report is a bound
  /// (error_is_bound). By the rules paper and residual they stop where these say so.
  Report solve(const BlockTree& A, std::span<const double> b, std::span<double> x,
               const Recover& recover);
  /// The same without motion: the error of x alone counts.
  Report solve(const BlockTree& A, std::span<const double> b, std::span<double> x);

  bool is_direct() const { return direct_; }
  /// Did rounding keep the accelerations of the last solution, but not its forces, from the
  /// tolerance? They are to be refined.
  bool motion_is_rough() const { return motion_is_rough_; }

 private:
  double error(const BlockTree& A, std::span<const double> b, std::span<const double> x);
  void learn(double strictness) {
    if (learns_) strictness_ = strictness;
  }

  bool direct_, learns_, motion_is_rough_ = false, factored_ = false;
  StopRule rule_;
  EnergyBound fixed_;
  std::shared_ptr<const EnergyBound> asked_;  ///< null: fixed_
  std::shared_ptr<EnergyBound> given_;        ///< what the solver reads
  int max_iterations_;
  double strictness_ = 1.0;
  std::unique_ptr<LinearSolver> solver_;
  TreeFactor factor_;
  std::vector<double> residual_, correction_;
};

}  // namespace linkwise
