#pragma once
// A joint that closes a loop, from the pose of the frames that it joins: E, fixed in the body
// inboard of it, and F, fixed in the body outboard. A joint of the tree is given coordinates and
// moves a body. This one is given the pose of F in E, and its coordinates are what comes closest.
// What is then left of the pose is the gap that position constraints must close.
#include <cmath>
#include <numbers>
#include <span>

#include "linkwise/base/assert.hpp"
#include "linkwise/joints/complement.hpp"
#include "linkwise/joints/element.hpp"

namespace linkwise {

/// The quaternion x, y, z, w of a rotation into child axes, as rotation_to_child() takes it. From
/// the largest component, so that no digits are lost; of the two the one nearer to `last`.
inline void quaternion_of(const Mat3<double>& to_child, const double* last, double* quaternion) {
  const auto& m = to_child.m;
  const double squares[4] = {1 + m[0] - m[4] - m[8], 1 - m[0] + m[4] - m[8], 1 - m[0] - m[4] + m[8],
                             1 + m[0] + m[4] + m[8]};
  int k = 3;
  for (int i = 0; i < 3; ++i)
    if (squares[i] > squares[k]) k = i;
  // Four times the products of the components.
  const double xy = m[1] + m[3], xz = m[2] + m[6], yz = m[5] + m[7], xw = m[5] - m[7],
               yw = m[6] - m[2], zw = m[1] - m[3];
  const double rows[4][4] = {{squares[0], xy, xz, xw},
                             {xy, squares[1], yz, yw},
                             {xz, yz, squares[2], zw},
                             {xw, yw, zw, squares[3]}};
  double scale = 0, along = 0;
  for (int i = 0; i < 4; ++i) {
    scale += rows[k][i] * rows[k][i];
    along += rows[k][i] * last[i];
  }
  scale = (along < 0 ? -1 : 1) / std::sqrt(scale);
  for (int i = 0; i < 4; ++i) quaternion[i] = scale * rows[k][i];
}

/// Axis times angle, at most a half turn, of the rotation that takes the first axes to the child's.
inline Vec3<double> rotation_vector(const Mat3<double>& to_child) {
  const auto& m = to_child.m;
  const Vec3<double> sine{0.5 * (m[5] - m[7]), 0.5 * (m[6] - m[2]), 0.5 * (m[1] - m[3])};
  if (const double square = dot(sine, sine); square < 1e-6 && m[0] + m[4] + m[8] > 1)
    return (1 + square * (1.0 / 6 + square * 3 / 40)) * sine;
  constexpr double positive[4] = {0, 0, 0, 1};
  double p[4];
  quaternion_of(to_child, positive, p);
  const Vec3<double> v{p[0], p[1], p[2]};
  const double length = std::sqrt(dot(v, v));
  return (length > 0 ? 2 * std::atan2(length, p[3]) / length : 2) * v;
}

/// The angle that is `angle` but for whole turns and nearest to `last`.
inline double nearest_turn(double angle, double last) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle + turn * std::round((last - angle) / turn);
}

/// The turn about z by a rotation into child axes.
inline double turn_of(const Mat3<double>& to_child) {
  return std::atan2(to_child.m[1] - to_child.m[3], to_child.m[0] + to_child.m[4]);
}

namespace closure {

/// E -> F as seen behind the element's placement.
inline Transform<double> behind_placement(const Element& e, const Transform<double>& X) {
  return {X.R * transpose(e.placement.R), e.placement.R * (X.r - e.placement.r)};
}

inline void one_element(const Element& e, const Transform<double>& X_FE, double* q) {
  const Transform<double> X = behind_placement(e, X_FE);
  double* own = q + e.q;
  switch (e.kind) {
    case ElementKind::fixed:
    case ElementKind::own:
    case ElementKind::elastic:
      break;
    case ElementKind::revolute:
      own[0] = nearest_turn(turn_of(X.R), own[0]);
      break;
    case ElementKind::prismatic:
      own[0] = X.r.z;
      break;
    case ElementKind::helical:  // how far it has advanced says which turn it is in
      own[0] = nearest_turn(turn_of(X.R), e.pitch != 0 ? X.r.z / e.pitch : own[0]);
      break;
    case ElementKind::planar:
      own[0] = X.r.x;
      own[1] = X.r.y;
      own[2] = nearest_turn(turn_of(X.R), own[2]);
      break;
    case ElementKind::spherical:
      quaternion_of(X.R, own, own);
      break;
    case ElementKind::floating:
      own[0] = X.r.x;
      own[1] = X.r.y;
      own[2] = X.r.z;
      quaternion_of(X.R, own + 3, own + 3);
      break;
  }
}

/// Two hinges about axes that cross: what the first does to the second's axis, and what the second
/// does to the first's.
inline void two_hinges(const Element& first, const Element& second, const Transform<double>& X_FE,
                       double* q) {
  const auto& M = behind_placement(first, X_FE).R.m;  // Rz(q2)^T A Rz(q1)^T
  const auto& A = second.placement.R.m;
  const auto angle = [](double from_x, double from_y, double to_x, double to_y) {
    return std::atan2(from_x * to_y - from_y * to_x, from_x * to_x + from_y * to_y);
  };
  q[first.q] = nearest_turn(angle(A[6], A[7], M[6], M[7]), q[first.q]);
  q[second.q] = nearest_turn(angle(M[2], M[5], A[2], A[5]), q[second.q]);
}

/// A slide and a turn about one axis.
inline void slide_and_turn(const Element& slide, const Element& turn, const Transform<double>& X_FE,
                           double* q) {
  const Transform<double> X = behind_placement(slide, X_FE);
  q[slide.q] = X.r.z - turn.placement.r.z;
  q[turn.q] = nearest_turn(turn_of(X.R * transpose(turn.placement.R)), q[turn.q]);
}

}  // namespace closure

/// Whether closure_coordinates() knows the stack: one element, two hinges that cross, a slide and a
/// turn about one axis. Those are all types of joints but composite ones.
inline bool can_close(std::span<const Element> stack) {
  if (stack.size() == 1) return true;
  if (stack.size() != 2 || stack[1].kind != ElementKind::revolute) return false;
  const Vec3<double>& r = stack[1].placement.r;
  const auto& R = stack[1].placement.R.m;
  const double together = std::abs(R[8]);  // of the cosine between the axes
  if (stack[0].kind == ElementKind::revolute) return dot(r, r) == 0 && together < 0.9999;
  return stack[0].kind == ElementKind::prismatic && r.x == 0 && r.y == 0 && together > 1 - 1e-15;
}

/// Coordinates of the stack from the pose of F in E, E -> F, into q at the elements' places. Those
/// of prescribed elements are given and stay. q holds the last values: angles are continued from
/// them, so that turns are counted, and of two quaternions the nearer one is taken. A stack that is
/// not among those of can_close() needs a case here: check_forest() lets all types pass but
/// composite ones.
inline void closure_coordinates(std::span<const Element> stack, const Transform<double>& X_FE,
                                double* q) {
  if (stack[0].prescribed) return;
  if (stack.size() == 1) return closure::one_element(stack[0], X_FE, q);
  LINKWISE_ASSERT(stack.size() == 2 && stack[1].kind == ElementKind::revolute,
                  "this stack closes no loop");
  if (stack[0].kind == ElementKind::revolute)
    return closure::two_hinges(stack[0], stack[1], X_FE, q);
  LINKWISE_ASSERT(stack[0].kind == ElementKind::prismatic, "this stack closes no loop");
  closure::slide_and_turn(stack[0], stack[1], X_FE, q);
}

/// What the joint holds. Everything is in F's axes, at F.
struct ClosureBasis {
  int n = 0;                ///< degrees of freedom
  Vector6<double> dual[6];  ///< P^+T: rates u_i = dual_i . (motion of F less that of E)
  Vector6<double> Q[6];     ///< the 6 - n directions held, orthonormal
  int rows() const { return 6 - n; }
};

inline void calc_closure_basis(const Motion<double>* P, int n, ClosureBasis& out) {
  out.n = n;
  calc_complement(P, n, out.dual, out.Q);
}

inline double along(const Vector6<double>& direction, const Vector6<double>& motion) {
  double sum = 0;
  for (int i = 0; i < 6; ++i) sum += direction[i] * motion[i];
  return sum;
}

/// What is left between the frame where the joint, at its coordinates, would put F and the frame F
/// itself: a translation and a rotation vector, in F's axes. X_J, X_FE: E -> each of them.
inline Vector6<double> closure_gap(const Transform<double>& X_J, const Transform<double>& X_FE) {
  const Vec3<double> r = X_FE.R * (X_FE.r - X_J.r);
  const Vec3<double> turned = rotation_vector(X_FE.R * transpose(X_J.R));
  return {r.x, r.y, r.z, turned.x, turned.y, turned.z};
}

/// The same of a joint of one element, whose coordinates it finds as closure_coordinates() does. A
/// hinge is turned back by the cosine and the sine that its angle comes from.
inline Vector6<double> element_gap(const Element& e, const Transform<double>& X_FE, double* q) {
  closure_coordinates({&e, 1}, X_FE, q);
  if (e.kind == ElementKind::spherical) {  // which takes any turn
    const Vec3<double> r = X_FE.R * (X_FE.r - e.placement.r);
    return {r.x, r.y, r.z, 0, 0, 0};
  }
  if (e.kind != ElementKind::revolute) return closure_gap(element_pose(e, q), X_FE);
  const Mat3<double> turned = X_FE.R * transpose(e.placement.R);
  const auto& m = turned.m;
  const double x = m[0] + m[4], y = m[1] - m[3], length = std::sqrt(x * x + y * y);
  const double c = length > 0 ? x / length : 1, s = length > 0 ? y / length : 0;
  Mat3<double> left = turned;
  for (int i = 0; i < 9; i += 3) {
    left.m[i] = c * m[i] + s * m[i + 1];
    left.m[i + 1] = c * m[i + 1] - s * m[i];
  }
  const Vec3<double> r = X_FE.R * (X_FE.r - e.placement.r), rest = rotation_vector(left);
  return {r.x, r.y, r.z, rest.x, rest.y, rest.z};
}

/// Position residuals g [rows], whose derivatives are Q^T (motion of F less that of E) where the
/// gap is closed.
inline void closure_residual(const ClosureBasis& basis, const Vector6<double>& gap, double* g) {
  for (int i = 0; i < basis.rows(); ++i) g[i] = along(basis.Q[i], gap);
}

}  // namespace linkwise
