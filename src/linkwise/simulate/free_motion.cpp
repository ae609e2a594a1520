#include "linkwise/simulate/free_motion.hpp"

#include <algorithm>
#include <cmath>

namespace linkwise {

FreeMotion::FreeMotion(const Model& model)
    : model_(model),
      mobility_(model),
      kernel_(model),
      tau_(model.nv()),
      rests_(model.nv()),
      moved_(model.nv()) {}

bool FreeMotion::evaluate(const double* q, const double* loop_q) {
  const auto mobility = mobility_.evaluate(q);
  if (mobility.empty()) return false;
  SweepInput<double> in;
  in.q = q;
  in.loop_q = loop_q;
  in.gravity_factor = 0;
  std::fill(tau_.begin(), tau_.end(), 0.0);
  in.tau = tau_.data();
  if (!kernel_.evaluate(in, rests_.data(), nullptr)) return false;
  // No two alike, so that they cancel nowhere by symmetry.
  for (int i = 0; i < model_.nv(); ++i)
    tau_[i] = mobility[i] > 0 ? (1.5 + std::sin(1.7 * i)) * (i % 3 == 1 ? -1 : 1) / mobility[i] : 0;
  if (!kernel_.evaluate(in, moved_.data(), nullptr)) return false;
  largest_ = 0;
  for (int i = 0; i < model_.nv(); ++i) {
    moved_[i] -= rests_[i];
    largest_ = std::max(largest_, std::abs(moved_[i]));
  }
  return std::isfinite(largest_);
}

}  // namespace linkwise
