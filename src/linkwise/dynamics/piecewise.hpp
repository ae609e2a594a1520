#pragma once
// One long chain, cut into pieces: one piece per SIMD lane, groups of lanes over threads. Inside a
// piece the articulated-body recursion; between pieces the constraint forces f of the cut joints,
// from a small A f = b [sharf1993] whose "bodies" are the pieces (compare [anderson2000]).
//
// The recursion carries along Psi (6 x 5), Lambda and beta. Psi is what unit constraint forces at
// the outboard cut do to the first body of the piece. Lambda and beta are what they and the known
// forces do at that cut. With J = Y^-1 of the first body of the floating piece, Q the cut joint's
// five constrained directions:
//     a_first = J (Q f_s + z tau_s - p - Psi f_{s+1}),
//     (X^T Q)_{s+1}^T a_last = Psi^T a_first - Lambda f_{s+1} + beta,
//     A_ss = Q^T J Q + (Psi^T J Psi + Lambda)_{s-1},    A_{s,s-1} = -(Psi^T J Q)_{s-1},
//     du_k = D_k^-1 (u_k - r_k f_{s+1} - U_k^T (X a + c)),   r_k = joint row of Psi.
// Joints that close loops push on last bodies of pieces, see piece_closure.hpp.
// The number of pieces depends on the chain alone, and the arithmetic of a lane depends on its own
// piece alone. So any number of threads gives the same bits.
#include <memory>
#include <span>
#include <vector>

#include "linkwise/dynamics/forward_dynamics.hpp"

namespace linkwise {

class LoopStates;
class PiecewiseChain;

class Piecewise : public DynamicsMethod {
 public:
  /// InputError unless suits(model).
  Piecewise(const Model& model, const DynamicsOptions& options);
  ~Piecewise() override;
  DynamicsReport evaluate(double t, const SweepInput<double>& in, double* du,
                          double* loads) override;
  bool finds_loops() const override;
  /// Of the cut joints.
  std::span<const double> constraint_force() const override;

  // Where loops close.
  /// As ArticulatedLoops::respond().
  bool respond(const double* q, const double* asked, double null, double* du);
  /// Loop joints at a state; torques may be null. They hold until the next evaluation.
  const LoopStates& find_loops(const SweepInput<double>& in);
  /// Of the last response or evaluation.
  const LoopReport& loop_report() const;

  /// A chain of revolute joints without rotors, none prescribed, of at least min_bodies, all of
  /// regular inertia; without couplings or bearings, and with few loops.
  static bool suits(const Model& model);
  /// With loops: does it take the model, and are there bodies enough for what these cost?
  static bool closes_cheaply(const Model& model);
  /// On shorter chains the pieces are too short to pay for the cut system
  /// (benchmarks/cpp/crossovers.cpp).
  static constexpr int worth_cutting = 64;
  static constexpr int min_bodies = 16;
  static int pieces(int n_bodies);

 private:
  std::unique_ptr<PiecewiseChain> chain_;
  std::vector<double> at_rest_;
};

}  // namespace linkwise
