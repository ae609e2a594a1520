#pragma once
// Forward dynamics of machines with closed loops by all joint constraint forces at once: A f = b of
// a graph, by a sparse factor or by conjugate gradients. Where the recursion carries the forces of
// each loop along its path, this costs what the graph's own structure asks for, which is less where
// many loops are nested, as in nets.
#include <memory>
#include <vector>

#include "linkwise/constraint/graph_system.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/solve/direct/graph_factor.hpp"
#include "linkwise/solve/iterative/graph_conjugate_gradient.hpp"

namespace linkwise {

class LoopedConstraintForce : public DynamicsMethod {
 public:
  /// InputError where the solver takes trees alone, or the model has what GraphSystem does not
  /// take.
  LoopedConstraintForce(const Model& model, const DynamicsOptions& options);

  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                          double* loads) override;
  std::span<const double> constraint_force() const override { return f_; }
  std::span<const double> coupling_load() const override { return coupling_load_; }

  /// As ArticulatedLoops::respond(), but that all independent directions are held: pivots of a
  /// graph do not say which of them are weak.
  bool respond(const double* q, const double* asked, double* du);
  const LoopReport& report() const { return loops_; }

 private:
  Report solve(const std::vector<double>& b, std::vector<double>& x, bool least);
  bool refine(const SweepInput<double>& in, double* du, double* loads, bool least);
  double relative_change() const;
  void describe(double missed);

  const Model* model_;
  GraphSystem system_;
  std::unique_ptr<GraphFactor> factor_;  ///< or
  std::unique_ptr<GraphConjugateGradient> iteration_;
  LoopReport loops_;
  int rows_ = 0;  ///< that loops and couplings hold
  double missed_ = 0;
  struct {
    std::vector<double> f, du, loads;
  } before_;  ///< a refinement
  std::vector<double> f_, df_, coupling_load_, at_rest_;
};

}  // namespace linkwise
