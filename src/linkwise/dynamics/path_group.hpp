#pragma once
// The articulated-body recursion along the paths of one group, a path a lane. The equations are
// those of articulated_body.hpp; how groups follow each other is in articulated_paths.hpp.
#include <algorithm>
#include <array>
#include <vector>

#include "linkwise/dynamics/lane_bodies.hpp"
#include "linkwise/kinematics/body_state.hpp"

namespace linkwise {

/// What a body gives to the one that carries it: articulated inertia and bias wrench in its frame.
template <class S>
struct Gift {
  ArticulatedInertia<S> Y;
  Force<S> p;
};

/// Where a body of a path is: group, position and lane.
struct Seat {
  int group = -1, position = 0, lane = 0;
};

template <class S>
class PathGroup {
 public:
  static constexpr int lanes = lane_count<S>;
  /// A path begins here, seen from the base.
  struct Entry {
    int position, lane;
    int parent;  ///< the body that carries it, or -1: ground
    Seat seat;   ///< the parent's, where it is on a path
  };
  /// A path of this or of an earlier group ends at the body of this seat.
  struct Arrival {
    int position, lane;
    Seat from;
  };
  /// A body of this seat carries bodies that are on no path.
  struct Carrier {
    int position, lane, body;
  };

  /// body_at(k, l): body of position k in lane l, or -1.
  template <class BodyAt>
  PathGroup(const Model& model, int length, BodyAt&& body_at)
      : constants_(model, length, body_at), place_(length), state_(length), gift_of_(length, -1) {
    for (int k = 0; k < length; ++k)
      for (int l = 0; l < lanes; ++l) {
        const int n = body_at(k, l);
        place_[k].body[l] = n;
        place_[k].q[l] = n < 0 ? -1 : model.topology[n].q;
        place_[k].v[l] = n < 0 ? -1 : model.topology[n].v;
      }
  }

  int length() const { return constants_.length(); }
  /// Both from the outermost position to the innermost one, arrivals in the order of their sums.
  std::vector<Entry> entries;
  std::vector<Arrival> arrivals;
  std::vector<Carrier> carriers;

  void add_entry(const Entry& entry) {
    entries.push_back(entry);
    if (gift_of_[entry.position] >= 0) return;
    gift_of_[entry.position] = static_cast<int>(gift_.size());
    gift_.push_back({});
  }
  void keep_loads() { eliminated_.resize(length()); }

  /// f(position, lane, body) of all its bodies.
  template <class F>
  void for_bodies(F&& f) const {
    for (int k = 0; k < length(); ++k)
      for (int l = 0; l < lanes; ++l)
        if (const int n = place_[k].body[l]; n >= 0) f(k, l, n);
  }

  Motion<double> motion(int k, int l) const { return get_lanes<Motion<double>, S>(state_[k].v, l); }
  Force<double> load(int k, int l) const { return get_lanes<Force<double>, S>(state_[k].U, l); }
  const Gift<S>& gift_at(int k) const { return gift_[gift_of_[k]]; }
  void add_wrench(int k, int l, const Force<double>& p) { add_lanes<S>(state_[k].p, l, p); }

  /// parent(entry): the motion of the body that carries the path.
  template <class ParentMotion>
  void calc_velocities(const SweepInput<double>& in, ParentMotion&& parent) {
    Motion<S> v{};
    size_t entry = entries.size();
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      enter(k, entry, parent, v);
      constants_.turn_to(k, gather(in.q, place_[k].q), s.turn);
      s.rate = in.v ? gather(in.v, place_[k].v) : S{};
      s.u = gather(in.tau, place_[k].v);
      v = constants_.seen_at_child(k, s.turn, v);
      v.ang.z += s.rate;
      store(s.v, v);
      s.p = cross_dual(v, constants_[k].inertia * v);
    }
  }

  /// group(seat): that of a seat. carried(carrier): the articulated inertia of what it carries.
  /// Returns the number of a body whose D is not positive, the last one found, or -1.
  template <bool with_loads, class GroupOf, class Carried>
  int tip_to_base(GroupOf&& group, Carried&& carried) {
    ArticulatedInertia<S> Y{};
    Force<S> p{};
    int failed = -1;
    size_t arrival = 0, carrier = 0;
    for (int k = 0; k < length(); ++k) {
      State& s = state_[k];
      add_inertia(Y, constants_[k].inertia);
      p += s.p;
      if ((arrival < arrivals.size() && arrivals[arrival].position == k) ||
          (carrier < carriers.size() && carriers[carrier].position == k)) {
        Gift<S> sum{};
        for (; arrival < arrivals.size() && arrivals[arrival].position == k; ++arrival) {
          const Arrival& at = arrivals[arrival];
          add_lanes<S>(sum, at.lane, group(at.from).gift_at(at.from.position), at.from.lane);
        }
        for (; carrier < carriers.size() && carriers[carrier].position == k; ++carrier)
          add_lanes<S>(sum.Y, carriers[carrier].lane, carried(carriers[carrier]));
        Y += sum.Y;
        p += sum.p;
      }
      const Force<S> U = RevoluteJoint::column(Y, 0.0);
      const S D = U.ang.z + constants_[k].stand_in;
      for (int l = 0; l < lanes; ++l)
        if (__builtin_expect(!(lane(D, l) > 0), 0)) failed = std::max(failed, place_[k].body[l]);
      const S D_inverse = 1.0 / D, u = s.u - p.ang.z;
      store(s.U, U);
      s.D_inverse = D_inverse;
      s.u = u;
      const Force<S> V{D_inverse * U.lin, D_inverse * U.ang};
      PlanarInertia<S> Z;
      eliminate_turn(Y, U, V, RevoluteJoint::bias(s.v, 0.0, s.rate), u, Z, p);
      if constexpr (with_loads) eliminated_[k] = {Z, p};
      Y = constants_.seen_at_parent(k, s.turn, Z);
      p = constants_.seen_at_parent(k, s.turn, p);
      if (gift_of_[k] >= 0) gift_[gift_of_[k]] = {Y, p};
    }
    return failed;
  }

  template <bool with_loads, class ParentMotion>
  void base_to_tip(ParentMotion&& parent, double* du) {
    Motion<S> a{};
    size_t entry = entries.size();
    for (int k = length() - 1; k >= 0; --k) {
      State& s = state_[k];
      enter(k, entry, parent, a);
      a = constants_.seen_at_child(k, s.turn, a);
      Force<S> joint_load;
      if constexpr (with_loads) {
        joint_load = eliminated_[k].Z * a;
        joint_load += eliminated_[k].p;
      }
      a += RevoluteJoint::bias(s.v, 0.0, s.rate);
      const S rate = s.D_inverse * (s.u - dot(a, s.U));
      for (int l = 0; l < lanes; ++l)
        if (const int i = place_[k].v[l]; i >= 0) du[i] = lane(rate, l);
      a.ang.z += rate;
      store(s.v, a);
      if constexpr (with_loads) store(s.U, joint_load);
    }
  }

 private:
  struct Place {
    std::array<int, lanes> body, q, v;
  };
  struct State {
    LaneTurn<S> turn;
    S rate, D_inverse, u;
    Motion<S> v;  ///< velocity, then acceleration
    Force<S> p;   ///< bias wrench
    Force<S> U;   ///< Y P; in the end the joint load
  };
  struct Eliminated {
    PlanarInertia<S> Z;
    Force<S> p;
  };

  static LW_INLINE S gather(const double* values, const std::array<int, lanes>& index) {
    S out{};
    for (int l = 0; l < lanes; ++l)
      if (index[l] >= 0) out[l] = values[index[l]];
    return out;
  }

  template <class ParentMotion>
  LW_INLINE void enter(int k, size_t& entry, ParentMotion&& parent, Motion<S>& v) const {
    for (; entry > 0 && entries[entry - 1].position == k; --entry)
      set_lanes<S>(v, entries[entry - 1].lane, parent(entries[entry - 1]));
  }

  LaneBodies<S> constants_;
  std::vector<Place> place_;
  std::vector<State> state_;
  std::vector<Eliminated> eliminated_;  ///< made when loads are first asked for
  std::vector<Gift<S>> gift_;           ///< of the positions where paths end
  std::vector<int> gift_of_;            ///< position -> index into gift_, or -1
};

}  // namespace linkwise
