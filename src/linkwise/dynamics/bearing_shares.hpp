#pragma once
// Of all loads that move a machine alike the ones that its bearings choose: those of least elastic
// work. Loads w may be changed by any sum of self-stresses S; with C what bearings yield to a unit
// of load, the sum is the alpha of the least
//     (w - S alpha)^T C (w - S alpha) / 2
// which is the limit of stiff bearings, after Menabrea. Self-stresses that load no direction in
// which a bearing yields are left as they are.
#include <vector>

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
  /// alpha [n] of loads w [n_loads][6]; what no bearing decides is as small as |alpha| is.
  void solve(const double* w, double* alpha);
  /// Sums of self-stresses that no bearing decides, [..][n], orthonormal.
  std::vector<double> undecided() const { return structure_.unseen(); }

 private:
  const Model& model_;
  std::vector<int> bearings_;
  int n_ = 0;
  PivotedQr structure_, weighted_;
  std::vector<double> decided_, rows_, turned_, b_, x_;
};

}  // namespace linkwise
