#pragma once
// Articulated-body recursion for trees and every joint: the steps of recursion/steps.hpp body by
// body, on one system or on lanes of systems; the branches of a large tree shared by threads
// [hwang1988]. The joint load is a by-product of the outward sweep: w_n = Ya X a_p + pa.
#include <memory>
#include <vector>

#include "linkwise/exec/executor.hpp"
#include "linkwise/recursion/branches.hpp"
#include "linkwise/recursion/tree_sweeps.hpp"

namespace linkwise {

template <class S>
class ArticulatedBody {
 public:
  explicit ArticulatedBody(const Model& model) : model_(&model), sweeps_(model) {}

  /// du [nv]; loads [n_joints][6] or null. Returns false when some D is not positive definite:
  /// `failed_body`.
  bool evaluate(const SweepInput<S>& in, S* du, S* loads) {
    sweeps_.start(loads != nullptr);
    if (branches_ && branches_->any()) {
      sweep_branches(in, du, loads != nullptr);
    } else {
      const auto& all = model_->kind_ranges;
      sweeps_.calc_velocities(in, all);
      sweeps_.add_external(in);
      sweeps_.eliminate_joints(in, all, loads != nullptr);
      sweeps_.accelerate_bodies(in, all, du, loads != nullptr);
    }
    if (loads) sweeps_.store_loads(in.q, loads);
    return failed_body() < 0;
  }

  /// The same for another right-hand side at the q of the last evaluate(), which succeeded and was
  /// asked for loads: with its factors, at half of its cost.
  void evaluate_again(const SweepInput<S>& in, S* du, S* loads) {
    const auto& all = model_->kind_ranges;
    if (in.v) {
      sweeps_.template calc_velocities<true>(in, all);
      sweeps_.add_external(in);
      sweeps_.template respond_joints<true>(in);
    } else {
      sweeps_.rest(in);
      sweeps_.add_external(in);
      sweeps_.template respond_joints<false>(in);
    }
    sweeps_.accelerate_bodies(in, all, du, true);
    sweeps_.store_loads(in.q, loads);
  }

  int failed_body() const { return sweeps_.failed_body(); }

  /// From now on threads share the branches of a large tree. They influence no result.
  void share_branches(Executor executor) {
    branches_ = std::make_unique<Branches>(*model_);
    executor_ = executor;
    if (!branches_->any()) return;
    for (const KindRange& range : branches_->trunk)
      for (int n = range.begin; n < range.end; ++n) sweeps_.add_to_opened(n);
    for (const auto& share : branches_->shares)
      for (const int root : share.roots)
        if (model_->topology[root].parent >= 0) roots_.push_back(root);
    from_root_.resize(roots_.size());
    for (size_t i = 0; i < roots_.size(); ++i) sweeps_.send_to(roots_[i], &from_root_[i]);
  }

 private:
  /// What the branches contribute to the trunk is kept apart and added in their order.
  void sweep_branches(const SweepInput<S>& in, S* du, bool with_loads) {
    const auto each = [&](auto&& sweep) {
      executor_.for_each(static_cast<int>(branches_->shares.size()),
                         [&](int i) { sweep(branches_->shares[i].kind_ranges); });
    };
    const auto& trunk = branches_->trunk;
    sweeps_.calc_velocities(in, trunk);
    each([&](const auto& ranges) { sweeps_.calc_velocities(in, ranges); });
    sweeps_.add_external(in);
    for (auto& contribution : from_root_) contribution.p = {};
    each([&](const auto& ranges) { sweeps_.eliminate_joints(in, ranges, with_loads); });
    sweeps_.clear_inertias(trunk);
    for (size_t i = 0; i < roots_.size(); ++i)
      sweeps_.receive(model_->topology[roots_[i]].parent, from_root_[i]);
    sweeps_.eliminate_joints(in, trunk, with_loads);
    sweeps_.accelerate_bodies(in, trunk, du, with_loads);
    each([&](const auto& ranges) { sweeps_.accelerate_bodies(in, ranges, du, with_loads); });
  }

  const Model* model_;
  TreeSweeps<S> sweeps_;
  std::unique_ptr<Branches> branches_;  ///< made where threads may share them
  Executor executor_;
  std::vector<int> roots_;  ///< of the branches that hang on the trunk
  std::vector<Contribution<S>> from_root_;
};

}  // namespace linkwise
