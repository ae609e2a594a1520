#pragma once
// What all iterative solvers share: coordinates, stop test, and the check of the result against the
// system as given. A method implements iterate() and, with a preconditioner of its own, prepare().

#include <vector>

#include "linkwise/linear/scaled_tree.hpp"
#include "linkwise/solve/solver.hpp"
#include "linkwise/solve/stop_test.hpp"

namespace linkwise {

class IterativeSolver : public LinearSolver {
 public:
  Report solve(const BlockTree& A, std::span<const double> b, std::span<double> x) final;

 protected:
  /// The coordinates in which iterate() works: scaled by the block diagonal, see ScaledTree, or the
  /// original ones, for preconditioners that bring their own scaling.
  enum class Coordinates { block_scaled, original };

  IterativeSolver(const SolverOptions& options, Coordinates coordinates)
      : LinearSolver(options), coordinates_(coordinates) {
    scaled_.set_executor(options.executor);
  }

  /// Once per solve, after scaling. An outcome other than `converged` ends the solve.
  virtual Outcome prepare(const BlockTree& A) {
    static_cast<void>(A);
    return Outcome::converged;
  }
  /// Improves x until stop says so.
  virtual void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) = 0;
  /// ||r||^2 in the norm of the preconditioner's inverse: times the inverse of the smallest
  /// eigenvalue, a bound on the error of whatever left the residual r.
  virtual double preconditioned_square(std::span<const double> residual);
  /// Called with the finished report.
  virtual void finished(const Report& report) { static_cast<void>(report); }
  /// The limit when the options give none.
  virtual int default_max_iterations(int size) const;

  /// y = A x in the coordinates of iterate().
  void multiply(std::span<const double> x, std::span<double> y) const;
  const ScaledTree& scaled() const { return scaled_; }
  const Executor& executor() const { return options_.executor; }
  const BlockTree& system() const { return *system_; }
  int failed_node() const { return failed_node_; }
  void set_failed_node(int node) { failed_node_ = node; }

 private:
  Outcome prepare_all(const BlockTree& A);
  Report run(const BlockTree& A, std::span<const double> b, std::span<double> x);
  bool rounding_may_matter(std::span<const double> x) const;
  void verify(std::span<const double> b, std::span<double> x, Report& report);
  int worst_node(std::span<const double> b, std::span<const double> x);
  double bound_error(std::span<const double> b, std::span<const double> x, bool accurate);

  Coordinates coordinates_;
  ScaledTree scaled_;
  StopTest stop_;
  const BlockTree* system_ = nullptr;
  int failed_node_ = -1;
  std::vector<double> b_, x_, residual_, correction_;
};

}  // namespace linkwise
