#pragma once
// One elementary motion of any kind, for the stacks that the general sweep walks element by
// element: its transform, its columns of the motion subspace (constant in its own frame), and
// dq/dt.
#include <cmath>
#include <cstdint>
#include <string_view>

#include "linkwise/joints/axis_joints.hpp"
#include "linkwise/spatial/elastic_port.hpp"

namespace linkwise {

enum class ElementKind : std::uint8_t {
  fixed,
  revolute,
  prismatic,
  helical,
  spherical,
  planar,
  floating,
  own,     ///< no motion of a joint: a coordinate of a body's own
  elastic  ///< on the port of an elastic body, whose coordinates move it
};

/// What a kind has.
struct ElementKindInfo {
  int nq, nv;
  int quaternion;  ///< where in its coordinates x, y, z, w of a quaternion start, -1: none
  int turning;     ///< how many of its first rates are linear, along axes that turn with the child
  const char* axis;               ///< what its axis is called, null where it has none
  const char *q_units, *v_units;  ///< of its coordinates, and of the integrals of its rates
};
inline constexpr ElementKindInfo element_kind_table[] = {
    {0, 0, -1, 0, nullptr, "", ""},                               // fixed
    {1, 1, -1, 0, "revolute", "rad", "rad"},                      // revolute
    {1, 1, -1, 0, "prismatic", "m", "m"},                         // prismatic
    {1, 1, -1, 0, "helical", "rad", "rad"},                       // helical
    {4, 3, 0, 0, nullptr, "1 1 1 1", "rad rad rad"},              // spherical
    {3, 3, -1, 2, "normal", "m m rad", "m m rad"},                // planar
    {7, 6, 3, 3, nullptr, "m m m 1 1 1 1", "m m m rad rad rad"},  // floating
    {1, 1, -1, 0, nullptr, "1", "1"},                             // own
    {0, 0, -1, 0, nullptr, "", ""},                               // elastic: as the body has
};
constexpr const ElementKindInfo& info_of(ElementKind kind) {
  return element_kind_table[static_cast<int>(kind)];
}

/// Of coordinate k of the kind.
constexpr std::string_view unit_of_coordinate(ElementKind kind, int k) {
  std::string_view units = info_of(kind).q_units;
  for (; k > 0; --k) units.remove_prefix(units.find(' ') + 1);
  return units.substr(0, units.find(' '));
}

/// One motion of a joint: a fixed placement after the previous frame, then the motion. Frames are
/// turned so that the axis of the first three kinds, and the normal of planar, is z.
struct Element {
  ElementKind kind = ElementKind::revolute;
  bool prescribed = false;
  int q = 0, v = 0;  ///< first index in q and v
  int nq = 1, nv = 1;
  int joint = 0;  ///< the user's joint it belongs to
  double pitch = 0;
  Transform<double> placement;  ///< previous frame -> this frame at zero
  /// Of an elastic one; the body, which the model keeps, owns it. Its placement leads to the frame
  /// that the shape starts from.
  const ElasticShape* shape = nullptr;
};

/// Rotation (child axes in parent components)^T of a quaternion x, y, z, w of any nonzero length.
template <class S>
LW_INLINE Mat3<S> rotation_to_child(const S* quaternion) {
  const S x = quaternion[0], y = quaternion[1], z = quaternion[2], w = quaternion[3];
  const S k = 2.0 / (x * x + y * y + z * z + w * w);
  return {{1.0 - k * (y * y + z * z), k * (x * y + z * w), k * (x * z - y * w), k * (x * y - z * w),
           1.0 - k * (x * x + z * z), k * (y * z + x * w), k * (x * z + y * w), k * (y * z - x * w),
           1.0 - k * (x * x + y * y)}};
}

/// Of an element with turning rates: components along the previous frame's axes -> the child's.
inline Mat3<double> element_rotation(const Element& e, const double* q) {
  if (e.kind == ElementKind::floating) return rotation_to_child(q + e.q + 3);
  const double c = std::cos(q[e.q + 2]), s = std::sin(q[e.q + 2]);
  return {c, s, 0, -s, c, 0, 0, 0, 1};
}

/// Its linear and its angular part of rates or forces v [nv]. In a plane z is 0, or all there is.
inline Vec3<double> linear_part(const Element& e, const double* v) {
  return {v[e.v], v[e.v + 1], info_of(e.kind).turning == 3 ? v[e.v + 2] : 0};
}
inline Vec3<double> angular_part(const Element& e, const double* v) {
  const double* own = v + e.v + info_of(e.kind).turning;
  return info_of(e.kind).turning == 2 ? Vec3<double>{0, 0, own[0]}
                                      : Vec3<double>{own[0], own[1], own[2]};
}

/// Previous frame -> this frame; q is the whole configuration.
template <class S>
LW_INLINE Transform<S> element_pose(const Element& e, const S* q) {
  const S* own = q + e.q;
  switch (e.kind) {
    case ElementKind::revolute:
      return RevoluteJoint::pose(e.placement, e.pitch, own[0]);
    case ElementKind::prismatic:
      return PrismaticJoint::pose(e.placement, e.pitch, own[0]);
    case ElementKind::helical:
      return HelicalJoint::pose(e.placement, e.pitch, own[0]);
    case ElementKind::spherical:
      return Transform<S>{rotation_to_child(own), {}} * e.placement;
    case ElementKind::planar: {
      S c, s;
      sincos(own[2], s, c);
      return Transform<S>{{{c, s, S{}, -s, c, S{}, S{}, S{}, broadcast<S>(1)}},
                          {own[0], own[1], S{}}} *
             e.placement;
    }
    case ElementKind::floating:
      return Transform<S>{rotation_to_child(own + 3), {own[0], own[1], own[2]}} * e.placement;
    case ElementKind::elastic:
      return elastic_pose(*e.shape, own) * e.placement;
    case ElementKind::fixed:
    case ElementKind::own:
      break;
  }
  return PrismaticJoint::pose(e.placement, 0.0, S{});
}

/// Are its coordinates a body's own, and no motion of a joint?
inline bool is_of_body(const Element& e) {
  return e.kind == ElementKind::own || e.kind == ElementKind::elastic;
}

/// Column k of the motion subspace in the element's own frame, for all kinds but the elastic one,
/// whose columns depend on its coordinates.
template <class S>
LW_INLINE Motion<S> element_column(const Element& e, int k) {
  Motion<S> column;
  const S one = broadcast<S>(1);
  int component = k;  // floating
  if (e.kind == ElementKind::revolute || e.kind == ElementKind::helical)
    component = 5;
  else if (e.kind == ElementKind::prismatic)
    component = 2;
  else if (e.kind == ElementKind::spherical)
    component = 3 + k;
  else if (e.kind == ElementKind::planar && k == 2)
    component = 5;
  S* parts[6] = {&column.lin.x, &column.lin.y, &column.lin.z,
                 &column.ang.x, &column.ang.y, &column.ang.z};
  *parts[component] = one;
  if (e.kind == ElementKind::helical) column.lin.z = broadcast<S>(e.pitch);
  return column;
}

/// f(k, column k) of an element of any kind, in its own frame.
template <class S, class F>
LW_INLINE void for_columns(const Element& e, const S* q, F&& f) {
  if (e.kind == ElementKind::elastic) {
    ElasticPort<S> port;
    calc_elastic_port(*e.shape, q + e.q, port);
    for (int k = 0; k < e.nv; ++k) f(k, port.P[k]);
  } else {
    for (int k = 0; k < e.nv; ++k) f(k, element_column<S>(e, k));
  }
}

/// dq/dt of one element from its rates. Quaternions keep whatever length they have.
inline void element_position_rate(const Element& e, const double* q, const double* u,
                                  double* rate) {
  q += e.q;
  u += e.v;
  rate += e.q;
  const auto quaternion_rate = [](const double* p, const double* w, double* out) {
    out[0] = 0.5 * (p[3] * w[0] + p[1] * w[2] - p[2] * w[1]);
    out[1] = 0.5 * (p[3] * w[1] + p[2] * w[0] - p[0] * w[2]);
    out[2] = 0.5 * (p[3] * w[2] + p[0] * w[1] - p[1] * w[0]);
    out[3] = -0.5 * (p[0] * w[0] + p[1] * w[1] + p[2] * w[2]);
  };
  switch (e.kind) {
    case ElementKind::fixed:
      break;
    case ElementKind::spherical:
      quaternion_rate(q, u, rate);
      break;
    case ElementKind::planar: {
      const double c = std::cos(q[2]), s = std::sin(q[2]);
      rate[0] = c * u[0] - s * u[1];
      rate[1] = s * u[0] + c * u[1];
      rate[2] = u[2];
      break;
    }
    case ElementKind::floating: {
      const Vec3<double> v =
          transpose_times(rotation_to_child(q + 3), Vec3<double>{u[0], u[1], u[2]});
      rate[0] = v.x;
      rate[1] = v.y;
      rate[2] = v.z;
      quaternion_rate(q + 3, u + 3, rate + 3);
      break;
    }
    default:
      for (int k = 0; k < e.nv; ++k) rate[k] = u[k];
  }
}

}  // namespace linkwise
