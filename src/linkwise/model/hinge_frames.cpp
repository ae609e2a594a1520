#include "linkwise/model/hinge_frames.hpp"

#include <cmath>
#include <optional>

namespace linkwise {
namespace {

using Xform = Transform<double>;

Xform inverse(const Xform& X) { return {transpose(X.R), -(X.R * X.r)}; }

/// Old frame -> new frame of a parent whose child has the placement `tree`; nothing where the
/// common normal is too far away.
std::optional<Xform> common_normal_frame(const Xform& tree) {
  const Vec3<double> e{tree.R.m[6], tree.R.m[7], tree.R.m[8]};  // child's axis, parent's components
  const Vec3<double>& r = tree.r;
  const double across = std::hypot(e.x, e.y), offset = std::hypot(r.x, r.y);
  double cosine = 1, sine = 0, slide = 0;
  if (across < 1e-12) {  // parallel: any common normal will do, so the origin stays
    if (offset > 0) {
      cosine = r.x / offset;
      sine = r.y / offset;
    }
  } else {
    cosine = -e.y / across;
    sine = e.x / across;
    // Along y' = z x x' the child's axis must meet the plane of z and x': r.y' + t e.y' = 0.
    const double r_y = -sine * r.x + cosine * r.y, e_y = -sine * e.x + cosine * e.y;
    const double t = -r_y / e_y;
    slide = r.z + t * e.z;
    const double far = 8 * std::sqrt(dot(r, r));
    if (std::abs(t) > far || std::abs(slide) > far) return std::nullopt;
  }
  return Xform{{{cosine, sine, 0, -sine, cosine, 0, 0, 0, 1}}, {0, 0, slide}};
}

/// Reads alpha, a, d, theta off a placement of that form and writes it back without rounding noise.
void set_hinge(BodyConstants<double>& k) {
  const double norm = std::hypot(k.tree.R.m[7], k.tree.R.m[8]);
  const double sa = k.sin_alpha = -k.tree.R.m[7] / norm;
  const double ca = k.cos_alpha = k.tree.R.m[8] / norm;
  k.theta = std::atan2(-k.tree.R.m[3], k.tree.R.m[0]);
  k.a = k.tree.r.x;
  k.d = -sa * k.tree.r.y + ca * k.tree.r.z;
  const double c = std::cos(k.theta), s = std::sin(k.theta);
  k.tree.R = {{c, s * ca, s * sa, -s, c * ca, c * sa, 0, -sa, ca}};
  k.tree.r = {k.a, -k.d * sa, k.d * ca};
}

}  // namespace

void choose_hinge_frames(Bodies& bodies, PlacedJoints& placed) {
  const int n_bodies = static_cast<int>(bodies.topology.size());
  std::vector<Xform> frame(n_bodies, Xform{Mat3<double>::identity(), {}});
  std::vector<char> has_frame(n_bodies, 0);
  for (int n = 0; n < n_bodies; ++n) {
    const int p = bodies.topology[n].parent;
    if (p < 0 || has_frame[p] || bodies.topology[n].joint_kind != JointKind::revolute ||
        bodies.topology[p].joint_kind == JointKind::general)
      continue;
    if (const auto X = common_normal_frame(bodies.constants[n].tree)) {
      frame[p] = *X;
      has_frame[p] = 1;
      bodies.topology[n].joint_kind = JointKind::hinge;
    }
  }
  for (int n = 0; n < n_bodies; ++n) {
    BodyTopology& body = bodies.topology[n];
    BodyConstants<double>& k = bodies.constants[n];
    Element& first = placed.elements[body.first_element];
    if (body.parent >= 0 && has_frame[body.parent]) {
      const Xform back = inverse(frame[body.parent]);
      k.tree = k.tree * back;
      first.placement = first.placement * back;
    }
    if (has_frame[n]) {
      k.tree = frame[n] * k.tree;
      BodyKinds::dispatch(body.body_kind, [&](auto kind) {
        auto& own = body_of_kind<typename decltype(kind)::Body>(body, k, bodies.others);
        own = moved(own, inverse(frame[n]));
      });
    }
    if (body.joint_kind == JointKind::hinge) set_hinge(k);
    if (body.joint_kind != JointKind::general) first.placement = k.tree;
  }
  for (JointInfo& joint : placed.joints)
    if (has_frame[joint.body]) joint.to_user = joint.to_user * inverse(frame[joint.body]);
}

}  // namespace linkwise
