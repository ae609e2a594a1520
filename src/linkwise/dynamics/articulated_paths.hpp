#pragma once
// Articulated-body recursion for one tree with the SIMD lanes filled: its revolute paths
// (recursion/paths.hpp) run side by side in groups, the rest (a floating base, sliding fingers)
// body by body before and after them. Groups that need nothing of each other are shared by threads.
// Paths, groups and the order of their sums depend on the model alone: any number of threads gives
// the same bits.
#include <algorithm>
#include <utility>
#include <vector>

#include "linkwise/exec/executor.hpp"
#include "linkwise/recursion/path_group.hpp"
#include "linkwise/recursion/paths.hpp"
#include "linkwise/recursion/tree_sweeps.hpp"

namespace linkwise {

template <class S>
class ArticulatedPaths {
 public:
  static constexpr int lanes = lane_count<S>;

  explicit ArticulatedPaths(const Model& model, Executor executor = {})
      : ArticulatedPaths(model, Paths(model), executor) {}
  ArticulatedPaths(const Model& model, Paths paths, Executor executor)
      : model_(&model), executor_(executor), paths_(std::move(paths)), others_(model) {
    const int n_paths = static_cast<int>(paths_.path.size());
    const int idle = (lanes - n_paths % lanes) % lanes;
    std::vector<PathPlace> place(model.n_bodies());
    for (int begin = -idle; begin < n_paths; begin += lanes) add_group(begin, place);
    for (int i = 0; i < n_paths; ++i) connect(i, place);
    connect_others(place);
    for (Group& group : groups_) group.sort();
    order_groups();
  }

  /// As ArticulatedBody::evaluate.
  bool evaluate(const SweepInput<double>& in, double* du, double* loads) {
    start(loads != nullptr);
    calc_velocities(in);
    add_to_paths(in, loads != nullptr);
    eliminate_paths(loads != nullptr);
    eliminate_trunk(in, loads != nullptr);
    accelerate_bodies(in, du, loads != nullptr);
    if (loads) {
      for (Group& group : groups_)
        group.for_bodies(
            [&](int k, int l, int n) { others_.set_joint_load(n, group.joint_load(k, l)); });
      others_.store_loads(in.q, loads);
    }
    return failed_body() < 0;
  }

  int failed_body() const { return others_.failed_body(); }

 private:
  using Group = PathGroup<S>;

  void add_group(int begin, std::vector<PathPlace>& place) {
    const int g = static_cast<int>(groups_.size());
    const auto& last = paths_.path[begin + lanes - 1];
    const auto body_at = [&](int k, int l) {
      const int i = begin + l;
      return i < 0 || k >= paths_.path[i].length ? -1 : paths_.body_at(i, k);
    };
    groups_.emplace_back(*model_, last.length, body_at);
    groups_.back().for_bodies([&](int k, int l, int n) { place[n] = {g, k, l}; });
  }

  /// Connects path i with the body that carries it.
  void connect(int i, const std::vector<PathPlace>& place) {
    const auto& path = paths_.path[i];
    const PathPlace root = place[paths_.body_at(i, path.length - 1)];
    const PathPlace parent = path.parent < 0 ? PathPlace{} : place[path.parent];
    groups_[root.group].add_root({root.position, root.lane, path.parent, parent});
    if (parent.group >= 0)
      groups_[parent.group].add_branch({parent.position, parent.lane, root});
    else if (path.parent >= 0)
      on_trunk_.push_back({path.parent, root});
  }

  /// Sums of the trunk are opened by the paths; those of path bodies are cleared in add_to_paths().
  void connect_others(const std::vector<PathPlace>& place) {
    for (const KindRange& range : paths_.trunk)
      for (int n = range.begin; n < range.end; ++n) others_.add_to_opened(n);
    std::vector<char> listed(model_->n_bodies(), 0);
    for (int n = 0; n < model_->n_bodies(); ++n) {
      const int parent = model_->topology[n].parent;
      if (place[n].group >= 0 || parent < 0 || place[parent].group < 0) continue;
      others_.add_to_opened(n);
      if (std::exchange(listed[parent], 1)) continue;
      const PathPlace& at = place[parent];
      groups_[at.group].add_outer_parent({at.position, at.lane, parent});
    }
  }

  /// Groups in rounds: those of one round need nothing of each other.
  void order_groups() {
    std::vector<int> round(groups_.size(), 0);
    for (size_t g = 0; g < groups_.size(); ++g) {
      for (const auto& branch : groups_[g].branches())
        if (branch.root.group != static_cast<int>(g))
          round[g] = std::max(round[g], round[branch.root.group] + 1);
      if (rounds_.size() <= static_cast<size_t>(round[g])) rounds_.resize(round[g] + 1);
      rounds_[round[g]].push_back(static_cast<int>(g));
    }
    for (const auto& groups : rounds_) {
      int positions = 0;
      for (const int g : groups) positions += groups_[g].length();
      executor_of_round_.push_back(executor_.where_it_pays(Worth::region, positions));
    }
  }

  template <class F>
  void in_round(size_t r, F&& f) {
    executor_of_round_[r].for_each(static_cast<int>(rounds_[r].size()),
                                   [&](int i) { f(groups_[rounds_[r][i]]); });
  }
  template <class F>
  void base_to_tip(F&& f) {
    for (size_t r = rounds_.size(); r-- > 0;) in_round(r, f);
  }

  void start(bool with_loads) {
    others_.start(with_loads);
    if (!with_loads || keeps_loads_) return;
    keeps_loads_ = true;
    for (Group& group : groups_) group.keep_loads();
  }

  void calc_velocities(const SweepInput<double>& in) {
    others_.calc_velocities(in, paths_.trunk);
    base_to_tip([&](Group& group) {
      group.calc_velocities(in, [&](const auto& root) {
        if (const PathPlace& at = root.place; at.group >= 0)
          return groups_[at.group].velocity(at.position, at.lane);
        return root.parent >= 0 ? others_.velocity(root.parent) : Motion<double>{};
      });
    });
    for (Group& group : groups_)
      for (const auto& at : group.outer_parents())
        others_.set_velocity(at.body, group.velocity(at.position, at.lane));
    others_.calc_velocities(in, paths_.outer);
  }

  /// Adds external wrenches, and what the bodies on no path contribute to the bodies that carry
  /// them.
  void add_to_paths(const SweepInput<double>& in, bool with_loads) {
    if (!in.external && paths_.outer.empty()) return;
    const auto for_receivers = [&](auto&& f) {
      for (Group& group : groups_)
        if (in.external)
          group.for_bodies([&](int k, int l, int n) { f(group, k, l, n); });
        else
          for (const auto& at : group.outer_parents()) f(group, at.position, at.lane, at.body);
    };
    for_receivers([&](Group&, int, int, int n) { others_.clear(n); });
    others_.add_external(in);
    others_.eliminate_joints(in, paths_.outer, with_loads);
    for_receivers(
        [&](Group& group, int k, int l, int n) { group.add_wrench(k, l, others_.sum(n).p); });
  }

  void eliminate_paths(bool with_loads) {
    for (size_t r = 0; r < rounds_.size(); ++r)
      in_round(r, [&](Group& group) {
        const auto of = [&](const PathPlace& at) -> const Group& { return groups_[at.group]; };
        const auto outer = [&](const auto& at) -> const auto& { return others_.sum(at.body).Y; };
        const int failed = group.eliminate_joints(of, outer, with_loads);
        if (failed >= 0) others_.fail(failed);
      });
  }

  void eliminate_trunk(const SweepInput<double>& in, bool with_loads) {
    others_.clear_inertias(paths_.trunk);
    for (const auto& [parent, root] : on_trunk_) {
      const Contribution<S>& of_lanes = groups_[root.group].from_roots_at(root.position);
      others_.receive(parent, get_lanes<Contribution<double>, S>(of_lanes, root.lane));
    }
    others_.eliminate_joints(in, paths_.trunk, with_loads);
  }

  void accelerate_bodies(const SweepInput<double>& in, double* du, bool with_loads) {
    others_.accelerate_bodies(in, paths_.trunk, du, with_loads);
    const Motion<double> ground = ground_acceleration<double>(*model_, in.gravity_factor);
    base_to_tip([&](Group& group) {
      const auto parent = [&](const auto& root) {
        if (const PathPlace& at = root.place; at.group >= 0)
          return groups_[at.group].acceleration(at.position, at.lane);
        return root.parent >= 0 ? others_.acceleration(root.parent) : ground;
      };
      group.accelerate_bodies(parent, du, with_loads);
    });
    for (Group& group : groups_)
      for (const auto& at : group.outer_parents())
        others_.set_acceleration(at.body, group.acceleration(at.position, at.lane));
    others_.accelerate_bodies(in, paths_.outer, du, with_loads);
  }

  const Model* model_;
  Executor executor_;
  Paths paths_;
  TreeSweeps<double> others_;  ///< trunk and outer bodies; external wrenches and loads of all
  std::vector<Group> groups_;
  std::vector<std::vector<int>> rounds_;
  std::vector<Executor> executor_of_round_;
  /// Roots of paths that hang on bodies of the trunk.
  struct OnTrunk {
    int parent;
    PathPlace root;
  };
  std::vector<OnTrunk> on_trunk_;
  bool keeps_loads_ = false;
};

}  // namespace linkwise
