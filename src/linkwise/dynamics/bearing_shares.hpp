#pragma once
// Of all loads that move a machine alike the ones that its bearings choose: those of least elastic
// work. Loads w may be changed by any sum of self-stresses S; with C what bearings yield to a unit
// of load, the sum is the alpha of the least
//     (w - S alpha)^T C (w - S alpha) / 2
// which is the limit of stiff bearings, after Menabrea. Self-stresses that load no direction in
// which a bearing yields are left as they are. Bearings that do not fit, by e, make that the alpha
// of S^T (C (w - S alpha) - e) = 0: deformations and misfits close the loops together. Where what
// holds against a misfit does not yield its loads have no limit: that part of it is left out.
#include <vector>

#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/linear/pivoted_qr.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

class BearingShares {
 public:
  /// Of these bearings of the model. length: by which moments are compared with forces.
  BearingShares(const Model& model, std::vector<int> bearings);

  bool empty() const { return bearings_.empty(); }
  /// Self-stresses [n][n_loads][6].
  void factor(int n, const double* S, double length);
  /// What the bearings do not fit by where the machine stands, after factor() there.
  void place_misfits(const double* q, const LoopStates& loops);
  /// alpha [n] of loads w [n_loads][6], of the self-stresses S of the last factor; what no bearing
  /// decides is as small as |alpha| is. misfit: times what was placed.
  void solve(const double* w, const double* S, double misfit, double* alpha);
  /// Sums of self-stresses that no bearing decides, [..][n], orthonormal.
  std::vector<double> undecided() const { return structure_.unseen(); }

 private:
  void find_rigid(const double* S, double largest);
  void leave_out_rigid(size_t b, Vector6<double>& misfit) const;

  const Model& model_;
  std::vector<int> bearings_;
  bool has_misfits_ = false;
  double length_ = 1;
  /// By bearing: directions of load [..][6], orthonormal, of self-stresses that it does not decide.
  std::vector<std::vector<double>> rigid_;
  std::vector<Mat3<double>> unturned_;   ///< by bearing: its joint's axes as drawn -> parent's
  std::vector<Vector6<double>> misfit_;  ///< [bearings], in the axes of their loads
  int n_ = 0;
  PivotedQr structure_, weighted_;
  std::vector<double> decided_, rows_, turned_, b_, x_, gap_, turned_gap_;
};

/// Forces [n_loads][3] that the preloads of bearings put on the child where nothing else acts, in
/// the axes of their loads at q; zeros without one. loops: at q.
std::vector<Vec3<double>> preload_forces(const Model& model, const double* q,
                                         const LoopStates& loops);

}  // namespace linkwise
