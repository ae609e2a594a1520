#pragma once
// Articulated-body recursion for one tree with the SIMD lanes filled: its revolute paths
// (kinematics/paths.hpp) run side by side in groups, the rest (a floating base, sliding fingers) by
// the plain recursion before and after them. Groups that need nothing of each other are shared by
// threads. Paths, groups and the order of their sums depend on the model alone: any number of
// threads gives the same bits.
#include <algorithm>
#include <functional>
#include <vector>

#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/path_group.hpp"
#include "linkwise/kinematics/paths.hpp"

namespace linkwise {

template <class S>
class ArticulatedPaths {
 public:
  static constexpr int lanes = lane_count<S>;

  explicit ArticulatedPaths(const Model& model, int threads = 1)
      : ArticulatedPaths(model, Paths(model), threads) {}
  ArticulatedPaths(const Model& model, Paths paths, int threads)
      : model_(&model), threads_(threads), paths_(std::move(paths)), plain_(model) {
    const int n_paths = static_cast<int>(paths_.path.size());
    const int idle = (lanes - n_paths % lanes) % lanes;
    std::vector<Seat> seat(model.n_bodies());
    for (int begin = -idle; begin < n_paths; begin += lanes) add_group(begin, seat);
    for (int i = 0; i < n_paths; ++i) connect(i, seat);
    // The trunk gets what the paths give before, and outer bodies are not all that a carrier gets.
    for (const KindRange& range : paths_.trunk)
      for (int n = range.begin; n < range.end; ++n) plain_.only_add(n);
    std::vector<char> carries(model.n_bodies(), 0);
    for (int n = 0; n < model.n_bodies(); ++n) {
      if (seat[n].group >= 0) continue;
      const int parent = model.topology[n].parent;
      if (parent < 0 || seat[parent].group < 0) continue;
      plain_.only_add(n);
      if (carries[parent]) continue;
      carries[parent] = 1;
      const Seat& at = seat[parent];
      groups_[at.group].carriers.push_back({at.position, at.lane, parent});
    }
    for (Group& group : groups_) {
      const auto outermost = [](const auto& a, const auto& b) { return a.position < b.position; };
      std::stable_sort(group.entries.begin(), group.entries.end(), outermost);
      std::stable_sort(group.arrivals.begin(), group.arrivals.end(), outermost);
      std::stable_sort(group.carriers.begin(), group.carriers.end(), outermost);
    }
    order_groups();
  }

  /// As ArticulatedBody::evaluate.
  bool evaluate(const SweepInput<double>& in, double* du, double* loads) {
    if (loads && !keeps_loads_) {
      keeps_loads_ = true;
      for (Group& group : groups_) group.keep_loads();
    }
    plain_.start(loads);
    plain_.calc_velocities(in, paths_.trunk);
    base_to_tip([&](Group& group) {
      group.calc_velocities(in, [&](const auto& at) { return parent_motion(at, {}); });
    });
    for (Group& group : groups_)
      for (const auto& c : group.carriers) plain_.body(c.body).v = group.motion(c.position, c.lane);
    plain_.calc_velocities(in, paths_.outer);
    add_outside(in, loads);
    tip_to_base(loads);
    for (const KindRange& range : paths_.trunk)
      for (int n = range.begin; n < range.end; ++n) plain_.body(n).Y = {};
    for (const auto& [parent, from] : to_trunk_) {
      const Gift<S>& gifts = groups_[from.group].gift_at(from.position);
      const auto gift = get_lanes<Gift<double>, S>(gifts, from.lane);
      plain_.body(parent).Y += gift.Y;
      plain_.body(parent).p += gift.p;
    }
    plain_.tip_to_base(in, paths_.trunk, loads);
    plain_.base_to_tip(in, paths_.trunk, du, loads);
    const Motion<double> ground = ground_acceleration<double>(*model_, in.gravity_factor);
    base_to_tip([&](Group& group) {
      const auto parent = [&](const auto& at) { return parent_motion(at, ground); };
      if (loads)
        group.template base_to_tip<true>(parent, du);
      else
        group.template base_to_tip<false>(parent, du);
    });
    for (Group& group : groups_)
      for (const auto& c : group.carriers) plain_.body(c.body).v = group.motion(c.position, c.lane);
    plain_.base_to_tip(in, paths_.outer, du, loads);
    if (loads) {
      for (Group& group : groups_)
        group.for_bodies([&](int k, int l, int n) { plain_.joint_load(n) = group.load(k, l); });
      plain_.store_loads(in, loads);
    }
    return plain_.failed_body() < 0;
  }

  int failed_body() const { return plain_.failed_body(); }

 private:
  using Group = PathGroup<S>;
  /// Positions that are worth a barrier between threads.
  static constexpr int fewest_for_threads = 128;

  void add_group(int begin, std::vector<Seat>& seat) {
    const int g = static_cast<int>(groups_.size());
    const auto& last = paths_.path[begin + lanes - 1];
    const auto body_at = [&](int k, int l) {
      const int i = begin + l;
      return i < 0 || k >= paths_.path[i].length ? -1 : paths_.body_at(i, k);
    };
    groups_.emplace_back(*model_, last.length, body_at);
    groups_.back().for_bodies([&](int k, int l, int n) { seat[n] = {g, k, l}; });
  }

  /// Path i to what carries it.
  void connect(int i, const std::vector<Seat>& seat) {
    const auto& path = paths_.path[i];
    const Seat at = seat[paths_.body_at(i, path.length - 1)];
    const Seat parent = path.parent < 0 ? Seat{} : seat[path.parent];
    groups_[at.group].add_entry({at.position, at.lane, path.parent, parent});
    if (parent.group >= 0)
      groups_[parent.group].arrivals.push_back({parent.position, parent.lane, at});
    else if (path.parent >= 0)
      to_trunk_.push_back({path.parent, at});
  }

  /// Groups in rounds: those of one round need nothing of each other.
  void order_groups() {
    std::vector<int> round(groups_.size(), 0);
    for (size_t g = 0; g < groups_.size(); ++g) {
      for (const auto& arrival : groups_[g].arrivals)
        if (arrival.from.group != static_cast<int>(g))
          round[g] = std::max(round[g], round[arrival.from.group] + 1);
      if (rounds_.size() <= static_cast<size_t>(round[g])) rounds_.resize(round[g] + 1);
      rounds_[round[g]].push_back(static_cast<int>(g));
    }
    for (const auto& groups : rounds_) {
      int positions = 0;
      for (const int g : groups) positions += groups_[g].length();
      shared_.push_back(groups.size() > 1 && positions >= fewest_for_threads);
    }
  }

  template <class F>
  void in_round(size_t r, F&& f) {
    const auto task = [&](int i) { f(groups_[rounds_[r][i]]); };
    parallel_for(static_cast<int>(rounds_[r].size()), shared_[r] ? threads_ : 1, std::ref(task));
  }
  template <class F>
  void base_to_tip(F&& f) {
    for (size_t r = rounds_.size(); r-- > 0;) in_round(r, f);
  }
  void tip_to_base(const double* loads) {
    for (size_t r = 0; r < rounds_.size(); ++r)
      in_round(r, [&](Group& group) {
        const auto of = [&](const Seat& seat) -> const Group& { return groups_[seat.group]; };
        const auto carried = [&](const auto& c) -> const auto& { return plain_.body(c.body).Y; };
        const int failed = loads ? group.template tip_to_base<true>(of, carried)
                                 : group.template tip_to_base<false>(of, carried);
        if (failed >= 0) plain_.fail(failed);
      });
  }

  template <class Entry>
  Motion<double> parent_motion(const Entry& at, const Motion<double>& ground) const {
    if (at.seat.group >= 0) return groups_[at.seat.group].motion(at.seat.position, at.seat.lane);
    return at.parent >= 0 ? plain_.body(at.parent).v : ground;
  }

  /// External wrenches, and what the bodies on no path give to those that carry them.
  void add_outside(const SweepInput<double>& in, const double* loads) {
    if (!in.external && paths_.outer.empty()) return;
    const auto for_receivers = [&](auto&& f) {
      for (Group& group : groups_)
        if (in.external)
          group.for_bodies([&](int k, int l, int n) { f(group, k, l, n); });
        else
          for (const auto& c : group.carriers) f(group, c.position, c.lane, c.body);
    };
    for_receivers([&](Group&, int, int, int n) {
      plain_.body(n).Y = {};
      plain_.body(n).p = {};
    });
    plain_.add_external(in);
    plain_.tip_to_base(in, paths_.outer, loads);
    for_receivers(
        [&](Group& group, int k, int l, int n) { group.add_wrench(k, l, plain_.body(n).p); });
  }

  const Model* model_;
  int threads_;
  Paths paths_;
  ArticulatedBody<double> plain_;  ///< trunk, outer bodies, and what passes between them and groups
  std::vector<Group> groups_;
  std::vector<std::vector<int>> rounds_;
  std::vector<char> shared_;  ///< round: among threads
  struct ToTrunk {
    int parent;
    Seat from;
  };
  std::vector<ToTrunk> to_trunk_;
  bool keeps_loads_ = false;
};

}  // namespace linkwise
