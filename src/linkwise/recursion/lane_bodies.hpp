#pragma once
// Rigid bodies on revolute joints, of different places of one machine side by side: position k of
// every lane's piece. Their constants differ from lane to lane, unlike those of several systems of
// one model.
#include <vector>

#include "linkwise/joints/axis_joints.hpp"
#include "linkwise/kinematics/placement.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/spatial/hinge.hpp"

namespace linkwise {

/// Puts a struct of doubles into lane l of the same struct of lanes.
template <class S, class A, class B>
LW_INLINE void set_lanes(A& to, int l, const B& from) {
  static_assert(sizeof(A) == sizeof(B) * lane_count<S>);
  const auto* source = reinterpret_cast<const double*>(&from);
  auto* target = reinterpret_cast<S*>(&to);
  for (size_t i = 0; i < sizeof(B) / sizeof(double); ++i) target[i][l] = source[i];
}
template <class B, class S, class A>
LW_INLINE B get_lanes(const A& from, int l) {
  static_assert(sizeof(A) == sizeof(B) * lane_count<S>);
  B to;
  const auto* source = reinterpret_cast<const S*>(&from);
  auto* target = reinterpret_cast<double*>(&to);
  for (size_t i = 0; i < sizeof(B) / sizeof(double); ++i) target[i] = source[i][l];
  return to;
}

/// Adds lane m of a struct of lanes to lane l of another.
template <class S, class A>
LW_INLINE void add_lanes(A& to, int l, const A& from, int m) {
  const auto* source = reinterpret_cast<const S*>(&from);
  auto* target = reinterpret_cast<S*>(&to);
  for (size_t i = 0; i < sizeof(A) / sizeof(S); ++i) target[i][l] += source[i][m];
}
template <class S, class A, class B>
LW_INLINE void add_lanes(A& to, int l, const B& from) {
  static_assert(sizeof(A) == sizeof(B) * lane_count<S>);
  const auto* source = reinterpret_cast<const double*>(&from);
  auto* target = reinterpret_cast<S*>(&to);
  for (size_t i = 0; i < sizeof(B) / sizeof(double); ++i) target[i][l] += source[i];
}

template <class S>
struct LaneBody {
  HingePlacement<S> placement;
  S theta;
  RigidBody<S> body;
  S stand_in;  ///< 1 for a massless filler beyond the end of a piece, else 0; it keeps D positive
  /// Index of its placement if some lane's joint is not a hinge, or -1.
  int skew = -1;
};

/// The turning joint of one position: what changes with the state.
template <class S>
struct LaneTurn {
  S cosine, sine;
};

template <class S>
class LaneBodies {
 public:
  static constexpr int lanes = lane_count<S>;

  /// body_at(k, l): the body of position k in lane l; a number outside the model stands for a
  /// filler.
  template <class BodyAt>
  LaneBodies(const Model& model, int length, BodyAt&& body_at) : body_(length) {
    for (int k = 0; k < length; ++k) {
      for (int l = 0; l < lanes; ++l) set_body(model, body_at(k, l), k, l);
      set_skew(model, k, body_at);
    }
  }

  int length() const { return static_cast<int>(body_.size()); }
  const LaneBody<S>& operator[](int k) const { return body_[k]; }
  LaneBody<S>& operator[](int k) { return body_[k]; }

  LW_INLINE void turn_to(int k, S q, LaneTurn<S>& turn) const {
    sincos(S(q + body_[k].theta), turn.sine, turn.cosine);
  }
  /// The placement of position k (kinematics/placement.hpp).
  struct Place {
    const LaneBodies& all;
    int k;
    const LaneTurn<S>& turn;

    LW_INLINE Motion<S> to_child(const Motion<S>& v) const {
      const LaneBody<S>& b = all.body_[k];
      return b.skew < 0 ? linkwise::to_child(b.placement, turn.cosine, turn.sine, v) : pose() * v;
    }
    LW_INLINE Force<S> to_parent(const Force<S>& f) const {
      const LaneBody<S>& b = all.body_[k];
      return b.skew < 0 ? linkwise::to_parent(b.placement, turn.cosine, turn.sine, f)
                        : transpose_times(pose(), f);
    }
    LW_INLINE ArticulatedInertia<S> to_parent(const PlanarInertia<S>& Y) const {
      const LaneBody<S>& b = all.body_[k];
      return b.skew < 0 ? linkwise::to_parent(b.placement, turn.cosine, turn.sine, Y)
                        : transform_to_parent(pose(), Y);
    }
    LW_INLINE Transform<S> pose() const {
      const LaneBody<S>& b = all.body_[k];
      const S c = turn.cosine, s = turn.sine;
      if (b.skew >= 0) return {turn_about_z(all.skew_[b.skew].R, c, s), all.skew_[b.skew].r};
      const S ca = b.placement.cos_alpha, sa = b.placement.sin_alpha;
      return {{{c, s * ca, s * sa, -s, c * ca, c * sa, S{}, -sa, ca}},
              {b.placement.a, -b.placement.d * sa, b.placement.d * ca}};
    }
  };
  LW_INLINE Place place(int k, const LaneTurn<S>& turn) const { return {*this, k, turn}; }

 private:
  void set_body(const Model& model, int n, int k, int l) {
    LaneBody<S>& to = body_[k];
    if (n < 0 || n >= model.n_bodies()) {  // turns with nothing, weighs nothing
      set_lanes<S>(to.placement, l, HingePlacement<double>{1, 0, 0, 0});
      to.theta[l] = 0;
      set_lanes<S>(to.body, l, RigidBody<double>{});
      to.stand_in[l] = 1;
      return;
    }
    const BodyConstants<double>& c = model.constants[n];
    set_lanes<S>(to.placement, l, placement(c));
    to.theta[l] = c.theta;
    set_lanes<S>(to.body, l, c.rigid);
    to.stand_in[l] = 0;
  }

  /// If some lane's joint is not a hinge, the whole position takes full placements, theta included.
  template <class BodyAt>
  void set_skew(const Model& model, int k, BodyAt&& body_at) {
    const auto in_model = [&](int n) { return n >= 0 && n < model.n_bodies(); };
    bool skew = false;
    for (int l = 0; l < lanes; ++l) {
      const int n = body_at(k, l);
      skew |= in_model(n) && model.topology[n].joint_kind != JointKind::hinge;
    }
    if (!skew) return;
    body_[k].skew = static_cast<int>(skew_.size());
    Transform<S> placements;
    for (int l = 0; l < lanes; ++l) {
      const int n = body_at(k, l);
      set_lanes<S>(
          placements, l,
          in_model(n) ? model.constants[n].tree : Transform<double>{Mat3<double>::identity(), {}});
      body_[k].theta[l] = 0;
    }
    skew_.push_back(placements);
  }

  std::vector<LaneBody<S>> body_;
  std::vector<Transform<S>> skew_;  ///< placements of the positions that are no hinges
};

}  // namespace linkwise
