#pragma once
// Loops over bodies by ranges of equal joints and bodies: what a loop does to one body is compiled
// once per kind, and which kind it is, is asked once per range.
#include <type_traits>
#include <utility>
#include <vector>

#include "linkwise/model/model.hpp"

namespace linkwise {

struct GeneralJoint {
  static constexpr bool is_hinge = false, leaves_zero_row = false;
};
/// Calls f(joint, begin, end) for a range of bodies with equal joints; joint is one of the
/// structs of axis_joints.hpp or GeneralJoint. One dispatch per range, none per body.
template <class F>
LW_INLINE void dispatch_kind_range(const KindRange& range, F&& f) {
  switch (range.joint_kind) {
    case JointKind::hinge:
      return f(HingeJoint{}, range.begin, range.end);
    case JointKind::revolute:
      return f(RevoluteJoint{}, range.begin, range.end);
    case JointKind::geared:
      return f(GearedJoint{}, range.begin, range.end);
    case JointKind::prismatic:
      return f(PrismaticJoint{}, range.begin, range.end);
    case JointKind::helical:
      return f(HelicalJoint{}, range.begin, range.end);
    case JointKind::general:
      return f(GeneralJoint{}, range.begin, range.end);
  }
}
template <class J>
inline constexpr bool is_general = std::is_same_v<J, GeneralJoint>;

/// Calls f(joint, bodies, begin, end), where bodies[n] is a body of a kind known while compiling.
/// Bodies that are not rigid are on general joints, whatever these are: every pair of kinds would
/// have to be compiled otherwise, and their own work hides what a joint of its own would spare.
template <class F>
LW_INLINE void dispatch_bodies(const Model& model, const KindRange& range, F&& f) {
  if (range.body_kind == BodyKind::rigid) {
    dispatch_kind_range(range, [&](auto joint, int begin, int end) {
      f(joint, BodiesOfKind<RigidBody<double>>{model}, begin, end);
    });
  } else {
    BodyKinds::dispatch_seen<1>(range.body_kind, [&](auto kind) {
      f(GeneralJoint{}, BodiesOfKind<typename decltype(kind)::Body>{model}, range.begin, range.end);
    });
  }
}

/// f(joint, n) for the bodies of some ranges; with the model at hand f(joint, n, body n).
template <class F>
LW_INLINE void for_bodies_base_to_tip(const std::vector<KindRange>& ranges, F&& f) {
  for (const KindRange& range : ranges)
    dispatch_kind_range(range, [&](auto joint, int begin, int end) {
      for (int n = begin; n < end; ++n) f(joint, n);
    });
}
template <class F>
LW_INLINE void for_bodies_tip_to_base(const std::vector<KindRange>& ranges, F&& f) {
  for (size_t i = ranges.size(); i-- > 0;)
    dispatch_kind_range(ranges[i], [&](auto joint, int begin, int end) {
      for (int n = end - 1; n >= begin; --n) f(joint, n);
    });
}

template <class F>
LW_INLINE void for_bodies_base_to_tip(const Model& model, const std::vector<KindRange>& ranges,
                                      F&& f) {
  for (const KindRange& range : ranges)
    dispatch_bodies(model, range, [&](auto joint, auto bodies, int begin, int end) {
      for (int n = begin; n < end; ++n) f(joint, n, bodies[n]);
    });
}
template <class F>
LW_INLINE void for_bodies_tip_to_base(const Model& model, const std::vector<KindRange>& ranges,
                                      F&& f) {
  for (size_t i = ranges.size(); i-- > 0;)
    dispatch_bodies(model, ranges[i], [&](auto joint, auto bodies, int begin, int end) {
      for (int n = end - 1; n >= begin; --n) f(joint, n, bodies[n]);
    });
}

/// The outward loop of every recursion: step(joint, n, the parent's motion), where of(n) is the
/// motion of body n, found before, and `ground` that of the ground. By reference: a copy would be
/// loaded in wide words that the narrow stores just before it cannot be forwarded to, a stall of a
/// dozen cycles per body.
template <class S, class Of, class Step>
LW_INLINE void sweep_outward(const Model& model, const std::vector<KindRange>& ranges,
                             const Motion<S>& ground, Of&& of, Step&& step) {
  for_bodies_base_to_tip(ranges, [&](auto joint, int n) {
    const int parent = model.topology[n].parent;
    const Motion<S>& carried = parent >= 0 ? of(parent) : ground;
    step(joint, n, carried);
  });
}

/// The same with step(joint, n, body n, the parent's motion).
template <class S, class Of, class Step>
LW_INLINE void sweep_bodies_outward(const Model& model, const std::vector<KindRange>& ranges,
                                    const Motion<S>& ground, Of&& of, Step&& step) {
  for_bodies_base_to_tip(model, ranges, [&](auto joint, int n, const auto& own) {
    const int parent = model.topology[n].parent;
    const Motion<S>& carried = parent >= 0 ? of(parent) : ground;
    step(joint, n, own, carried);
  });
}

/// By body: is it the first of its siblings that a tip-to-base sweep meets?
inline std::vector<char> first_of_siblings(const Model& model) {
  std::vector<char> first(model.n_bodies(), 0), met(model.n_bodies(), 0);
  for (int n = model.n_bodies() - 1; n >= 0; --n)
    if (const int parent = model.topology[n].parent; parent >= 0)
      first[n] = !std::exchange(met[parent], 1);
  return first;
}

}  // namespace linkwise
