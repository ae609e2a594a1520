#pragma once
// Equations of motion in the paper's own state: joint coordinates q and the absolute velocities v_n
// of the bodies, each in its frame [sharf1993, section 3]. Joint rates follow locally,
//     u_n = P_n^+ (v_n - X_n v_p),      dv_n/dt = a_n of A f = b,
// so that nothing passes from body to body, in return for 6 numbers per body and for a drift: what
// v_n - X_n v_p has in the constrained directions is held at zero by its derivative alone.
#include <memory>
#include <span>
#include <vector>

#include "linkwise/constraint/tree_system.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/solve/checked_solver.hpp"

namespace linkwise {

class BodyVelocities {
 public:
  /// InputError when the options ask for a method without constraint forces.
  BodyVelocities(const Model& model, const DynamicsOptions& options);

  int size() const { return 6 * model_->n_bodies(); }
  /// v [n_bodies][6] of joint rates u [nv].
  void from_rates(const double* q, const double* u, double* v);
  /// u [nv] of v. Returns the largest component of v_n - X_n v_p in a constrained direction, in m/s
  /// or rad/s, which is dropped.
  double to_rates(const double* q, const double* v, double* u);
  /// dv [n_bodies][6]; in.v holds the joint rates that to_rates() gave.
  DynamicsReport evaluate(double t, const SweepInput<double>& in, const double* v, double* dv);
  void accepted(double t) { guess_->accept(t, f_); }

 private:
  void unpack(const double* v);
  void calc_states(const SweepInput<double>& in, BodyState<double>* state,
                   GeneralState<double>* general) const;

  const Model* model_;
  TreeSystem system_;
  CheckedSolver solver_;
  std::unique_ptr<InitialGuess> guess_;
  std::vector<double> f_, du_;
  std::vector<Motion<double>> v_, gravity_;
};

}  // namespace linkwise
