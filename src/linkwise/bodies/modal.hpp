#pragma once
// An elastic body whose points move by shapes times coordinates, as finite elements and Craig and
// Bampton's reduction give them [craig1968]:
//     r = r0 + sum eta_i phi_i.
// It is clamped to its frame, where the shapes vanish, and may carry a port. Inertia is that of
// this very field, by integrals over the body that are taken once (inertia shape integrals):
//     m, mc0 = int r0, N0 = int r0 r0^T, C_i = int phi_i, N_i0 = int r0 phi_i^T,
//     N_ij = int phi_i phi_j^T.
// With them the equations of motion cost nothing that grows with the mesh, and are exact for the
// linear field [zwolfer2021]. What bending takes off a length is not in this field: a slender body
// that spins fast gets no stiffer. beam.hpp has it.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "linkwise/bodies/own_coordinates.hpp"
#include "linkwise/bodies/rigid.hpp"

namespace linkwise {

/// Of a modal body with n coordinates, in the order of LinkSpec::parameters. Behind these are, each
/// for all coordinates, C [3], N_i0 [3][3], Phi [3] and Psi [3] of its port, stiffness, damping; at
/// last N_ij [3][3] for j <= i.
struct ModalProperties {
  double n;         ///< coordinates
  double has_port;  ///< 1 or 0
  double mass;      ///< kg
  double mc[3];     ///< kg m
  double N0[6];     ///< xx xy yy xz yz zz, kg m2
  double axes[9];   ///< of all these vectors, as columns, in the link's frame
  double rest[3];   ///< of the port, m
};

/// Constants of a modal body, in its own axes.
struct ModalShape {
  explicit ModalShape(std::span<const double> parameters);

  int n;
  double m;
  Vec3<double> mc;
  Sym3<double> N0;
  std::vector<Vec3<double>> C;
  std::vector<Mat3<double>> N_i0;
  std::vector<Mat3<double>> N_ij;  ///< packed lower triangle
  std::vector<double> m_e, stiffness, damping;
  bool has_port;
  ElasticShape port;
};

struct ModalBody {
  static constexpr const char* name = "modal";
  static constexpr int n_parameters = -1;  ///< as many as its coordinates take
  static constexpr bool with_coordinates = true;

  static std::string fault(std::span<const double> parameters);
  static int port_coordinates(std::span<const double> parameters);
  static ModalBody make(const RigidBody<double>& link, std::span<const double> parameters);

  int n_coordinates() const { return shape->n; }
  double stiffness(int k) const { return shape->stiffness[k]; }
  double damping(int k) const { return shape->damping[k]; }
  const ElasticShape* port() const { return shape->has_port ? &shape->port : nullptr; }
  const Transform<double>& to_port_base() const { return to_axes; }

  std::shared_ptr<const ModalShape> shape;  ///< equal bodies share it
  Transform<double> to_axes;                ///< body's frame -> the one that its shape is given in
  RigidBody<double> straight;               ///< the body as if rigid
};

/// How many parameters a body with n coordinates has.
constexpr int n_modal_parameters(int n) {
  return static_cast<int>(sizeof(ModalProperties) / sizeof(double)) + 20 * n + 9 * n * (n + 1) / 2;
}

// With coordinates at zero and resting, it is a rigid body.
inline double mass(const ModalBody& body) { return mass(body.straight); }
template <class S>
LW_INLINE Force<S> inertia_times(const ModalBody& body, const Motion<S>& a) {
  return inertia_times(body.straight, a);
}
template <class S>
LW_INLINE Force<S> momentum(const ModalBody& body, const Motion<S>& v) {
  return momentum(body.straight, v);
}
template <class S>
LW_INLINE Force<S> momentum_bias(const ModalBody& body, const Motion<S>& v) {
  return momentum_bias(body.straight, v);
}
inline double kinetic_energy(const ModalBody& body, const Motion<double>& v) {
  return kinetic_energy(body.straight, v);
}
inline double potential_energy(const ModalBody& body, const Transform<double>& X,
                               const Vec3<double>& g) {
  return potential_energy(body.straight, X, g);
}
template <class S>
LW_INLINE void add_inertia(ArticulatedInertia<S>& Y, const ModalBody& body) {
  add_inertia(Y, body.straight);
}
inline const Inertia<double>& frozen_inertia(const ModalBody& body) {
  return body.straight.inertia;
}
inline Compliance<double> compliance(const ModalBody& body) { return compliance(body.straight); }
template <class From>
Matrix6<double> compliance(const ModalBody& body, const From& from, const Transform<double>& X) {
  return compliance(body.straight, from, X);
}
inline ModalBody moved(const ModalBody& body, const Transform<double>& X) {
  return {body.shape, body.to_axes * X, moved(body.straight, X)};
}

namespace modal {

/// sum of A_yz - A_zy, ...: of r phi^T it is r x phi.
template <class S>
LW_INLINE Vec3<S> vee(const Mat3<S>& A) {
  return {A.m[5] - A.m[7], A.m[6] - A.m[2], A.m[1] - A.m[3]};
}
template <class S>
LW_INLINE S trace(const Mat3<S>& A) {
  return A.m[0] + A.m[4] + A.m[8];
}

/// What the coordinates make of the integrals.
template <class S>
struct Integrals {
  Mat3<S> N_i[most_coordinates];  ///< int r phi_i^T
  Vec3<S> B_i[most_coordinates];  ///< int rate x phi_i, rate = sum xi_j phi_j
};

template <class S>
LW_INLINE void integrate(const ModalShape& of, const OwnState<S>& own, Integrals<S>& out) {
  for (int i = 0; i < of.n; ++i) {
    for (int e = 0; e < 9; ++e) out.N_i[i].m[e] = of.N_i0[i].m[e] + S{};
    out.B_i[i] = {};
  }
  for (int i = 0, at = 0; i < of.n; ++i)
    for (int j = 0; j <= i; ++j, ++at) {
      const Mat3<double>& N = of.N_ij[at];
      const Vec3<double> turn = vee(N);
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out.N_i[i].m[3 * r + c] += N.m[3 * c + r] * own.q[j];
      if (i == j) continue;  // its N is symmetric
      for (int e = 0; e < 9; ++e) out.N_i[j].m[e] += N.m[e] * own.q[i];
      out.B_i[i] -= own.rate(j) * turn;
      out.B_i[j] += own.rate(i) * turn;
    }
}

}  // namespace modal

template <class S>
void calc_equations(const ModalBody& body, const Motion<S>& v_frame, const OwnState<S>& own,
                    OwnEquations<S>& out) {
  const ModalShape& of = *body.shape;
  const Motion<S> v = body.to_axes * v_frame;
  const Vec3<S>& w = v.ang;
  modal::Integrals<S> now;
  modal::integrate(of, own, now);
  Vec3<S> mc{of.mc.x + S{}, of.mc.y + S{}, of.mc.z + S{}}, slip{}, gyro{};
  Sym3<S> N;
  for (int e = 0; e < 6; ++e) N.m[e] = of.N0.m[e] + S{};
  const Vec3<S> wv = cross(w, v.lin);
  const S ww = dot(w, w);
  for (int i = 0; i < of.n; ++i) {
    const S q = own.q[i], rate = own.rate(i);
    const Mat3<S>& A = now.N_i[i];
    mc += q * of.C[i];
    slip += rate * of.C[i];
    // N = int r r^T = N0 + sum eta_i (N_i + N_i0^T), which is symmetric.
    const auto both = [&](int r, int c) {
      return 0.5 *
             (A.m[3 * r + c] + A.m[3 * c + r] + of.N_i0[i].m[3 * r + c] + of.N_i0[i].m[3 * c + r]);
    };
    N.m[0] += q * both(0, 0);
    N.m[1] += q * both(0, 1);
    N.m[2] += q * both(1, 1);
    N.m[3] += q * both(0, 2);
    N.m[4] += q * both(1, 2);
    N.m[5] += q * both(2, 2);
    const Vec3<S> across = transpose_times(A, w);
    const S trace = modal::trace(A);
    gyro += (2.0 * rate) * (trace * w - across);
    out.M_e[i] = {{of.C[i].x + S{}, of.C[i].y + S{}, of.C[i].z + S{}}, modal::vee(A)};
    out.p_e[i] = dot(wv, of.C[i]) + dot(across, w) - ww * trace + 2.0 * dot(w, now.B_i[i]);
  }
  for (int k = 0; k < of.n * (of.n + 1) / 2; ++k) out.m_e[k] = of.m_e[k] + S{};
  Inertia<S> M;
  M.m = broadcast<S>(of.m);
  M.mc = mc;
  const S t = N.m[0] + N.m[2] + N.m[5];
  for (int e = 0; e < 6; ++e) M.I.m[e] = -N.m[e];
  for (const int e : {0, 2, 5}) M.I.m[e] += t;
  out.p.lin = of.m * wv + cross(w, cross(w, mc)) + 2.0 * cross(w, slip);
  // int r x (w x (w x r)) = - w x N w = w x (tr(N) 1 - N) w.
  out.p.ang = cross(mc, wv) + cross(w, M.I * w) + gyro;
  ArticulatedInertia<S> here{};
  add_inertia(here, M);
  out.M = transform_to_parent(body.to_axes, here);
  out.p = transpose_times(body.to_axes, out.p);
  for (int k = 0; k < of.n; ++k) out.M_e[k] = transpose_times(body.to_axes, out.M_e[k]);
}

}  // namespace linkwise
