#pragma once
// A f = b of a model's constraint forces at one state, to look at and to solve by any solver.
#include <string>
#include <vector>

#include "linkwise/constraint/tree_system.hpp"
#include "linkwise/dynamics/evaluator.hpp"

namespace linkwise {

class ConstraintSystem {
 public:
  /// Assembles it. The model must outlive it; the state is copied.
  ConstraintSystem(const Model& model, const BatchInput& state);

  const BlockTree& A() const { return system_.A(); }
  const std::vector<double>& b() const { return system_.b(); }
  bool finite() const;
  /// sqrt(f^T A f).
  double energy_norm(const std::vector<double>& f) const;

  /// f holds the guess, then the solution, or what a solve that failed has.
  EvaluationReport solve(const std::string& solver, const SolverOptions& options,
                         std::vector<double>& f);
  /// du [nv] and loads [n_loads][6] that constraint forces f lead to.
  void recover(const std::vector<double>& f, double* du, double* loads);

 private:
  SweepInput<double> input() const;

  const Model* model_;
  TreeSystem system_;
  std::vector<double> q_, v_, tau_, external_;
};

}  // namespace linkwise
