#pragma once
// Inverse dynamics of machines with closed loops: the torques of chosen, driven joints that make a
// given motion. Accelerations are affine in them, a = a_0 + B tau, and the columns of B are those
// of the forward dynamics at hand, so whatever that takes is taken here. At the driven degrees of
// freedom themselves
//     B_d tau = (a - a_0)_d,   B_d = S^T H_c^-1 S,
// with H_c^-1 what the constraints leave of H^-1 [featherstone2008, ch. 8]. B_d is positive
// definite where the driven motions are independent; where they determine the whole motion, all of
// a follows. Both are checked. Then B_d^-1 = N^T H N is the mass matrix of the machine in the
// driven coordinates, and N = H_c^-1 S B_d^-1 what they make of all rates.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/loop_rates.hpp"
#include "linkwise/dynamics/mobility.hpp"

namespace linkwise {

class DrivenInverse {
 public:
  /// driven: joints, those that close loops too. InputError where one is unknown, given twice, has
  /// no freedom, or where there is none; the text then tells which would do.
  DrivenInverse(const Model& model, std::span<const std::string> driven);

  int n_driven() const { return static_cast<int>(dofs_.size()); }

  /// What evaluate() gives; what is null is not computed.
  struct Output {
    double* tau = nullptr;       ///< [nv], of the driven joints of the tree, 0 of all others
    double* loop_tau = nullptr;  ///< [nv of loop joints], of the driven ones, 0 of all others
    double* loads = nullptr;     ///< [n_loads][6] of all joints
  };
  /// in.tau, in.loop_tau: what acts beside the drives. InputError, starting with `where`, if a [nv]
  /// opens the loops, or the driven joints cannot make it or repeat each other.
  DynamicsReport evaluate(const SweepInput<double>& in, const double* a, const std::string& where,
                          const Output& out);

  /// The mass matrix M [n_driven][n_driven] of the machine in the driven coordinates, rotors
  /// included, and the rates N [nv][n_driven] of the tree that each driven one makes. Either may be
  /// null. InputError, starting with `where`, unless the driven joints determine the whole motion
  /// and are independent.
  DynamicsReport reduce(const double* q, const std::string& where, double* M, double* N);

 private:
  /// A degree of freedom of the tree, or of loop joints.
  struct Dof {
    int index;
    bool closes;
    bool operator==(const Dof&) const = default;
  };

  void add_driven(const std::string& name);
  DynamicsReport forward(const SweepInput<double>& in, double* du, double* loads = nullptr);
  double energy(const double* q, const double* a);
  double calc_allowed(const SweepInput<double>& in, const double* a);
  DynamicsReport require_closed(const SweepInput<double>& in, const double* a, double allowed,
                                const std::string& where);
  void read_driven(const double* q, const double* du, double* x);
  double alone(const double* q, const Dof& dof);
  DynamicsReport factor(const double* q, const std::string& where);
  void solve(double* x) const;
  std::string largest(const double* got, const double* asked) const;
  std::string name_of(const Dof& dof) const;

  const Model& model_;
  std::unique_ptr<DynamicsMethod> method_;
  InverseDynamics<double> tree_;
  ArticulatedBody<double> open_;
  LoopRates loops_;
  std::vector<Dof> dofs_;       ///< driven degrees of freedom
  std::vector<double> B_;       ///< [dofs][dofs]; its Cholesky factor below the diagonal and on it
  std::vector<double> answer_;  ///< [dofs][nv]: accelerations by a torque at each alone
  std::vector<double> rest_, beside_, tau_, a0_, du_, miss_, work_;
  std::vector<double> loop_rest_, loop_beside_, loop_tau_;
};

}  // namespace linkwise
