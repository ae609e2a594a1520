#pragma once
// An elastic beam, clamped to its frame at one end and carrying a port at the other. Euler and
// Bernoulli's bending in both planes, stretch and twist; sections keep their shape and are
// symmetric, shear is left out.
//
// A point of its centre line is at
//     r(x) = (x + s(x) - 1/2 int_0^x (v'^2 + w'^2), v(x), w(x)),
// with stretch s and deflections v, w linear in the coordinates. The integral is what bending takes
// off the projection on the axis. With it a beam gets stiffer or softer under any load along it, a
// spin among them, without a matrix of geometric stiffness [kane1987]. Inertia is that of this very
// field, so energy is kept for deflections of any size; what the field can describe are small
// ones.
//
// v is a sum of polynomials of degree 2 .. n + 1 in x: of cubics, which are exact under forces and
// moments at the ends, and of `interior_modes` more. Their combinations are modes of the beam
// clamped at one end, so that stiffness is diagonal; a coordinate is the largest deflection of its
// mode.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "linkwise/bodies/own_coordinates.hpp"
#include "linkwise/bodies/rigid.hpp"

namespace linkwise {

/// Of a beam, in the order of LinkSpec::parameters.
struct BeamProperties {
  double length;              ///< m
  double mass_per_length;     ///< kg/m
  double EA, EIy, EIz, GJ;    ///< N, N m2 about the beam's y and z, N m2
  double rotary_y, rotary_z;  ///< density times second moment of area about y and z, kg m
  double damping_ratio;       ///< of every mode
  double interior_modes;      ///< in each plane, 0 to most_interior_modes
  double stretches;           ///< 1: it has a coordinate along x, 0: it is not extensible
  double axes[9];             ///< the beam's axes as columns, x along it, in the link's frame
  double start[3];            ///< of the beam, in the link's frame, m
  double area;                ///< of the section, m2
  double width, height;       ///< of the section's outside along y and z, m; 0: not known
  double round;               ///< 1: the outside is a circle
};
inline constexpr int most_interior_modes = 4;

/// Constants of a beam, in its own axes. Coordinates are stretch (where it has one), twist,
/// deflections along y, along z.
struct BeamModes {
  static constexpr int most_in_plane = 2 + most_interior_modes;
  static constexpr int n_packed = most_in_plane * (most_in_plane + 1) / 2;
  /// Deflections in one plane.
  struct Plane {
    double polynomial[most_in_plane][most_in_plane + 2];  ///< of each mode, powers of x / length
  };
  /// A point of the centre line.
  struct Station {
    double x, mass, stretch;
    double shape[2][most_in_plane];  ///< in each plane
    double H[2][n_packed];           ///< int_0^x of products of slopes
  };

  explicit BeamModes(const BeamProperties& given);

  BeamProperties of;
  int in_plane;    ///< coordinates of each plane
  int stretches;   ///< 0 or 1
  int n;           ///< coordinates
  Plane plane[2];  ///< of y, of z
  std::vector<Station> stations;
  std::vector<double> stiffness, damping;
  Sym3<double> rotary;                    ///< of all sections
  std::vector<Vec3<double>> rotary_side;  ///< int J Psi, [n]
  std::vector<double> m_e;                ///< what of it does not depend on the coordinates
  std::vector<Vec3<double>> lateral;      ///< int of shapes along y and z, [n]
  ElasticShape port;

  int twist() const { return stretches; }
  int first(int p) const { return stretches + 1 + p * in_plane; }
  /// Shape of mode k of plane p and its first derivatives at x.
  double shape(int p, int k, double x, int derivative = 0) const;
  Station station(double x) const;
  /// Stations between x and the end, with the masses of Gauss's quadrature: exact for the
  /// beam's inertia.
  std::vector<Station> stations_from(double x) const;

 private:
  void find_modes(int p, double EI, double rotary_inertia);
  void integrate();
};

struct Beam {
  static constexpr const char* name = "beam";
  static constexpr int n_parameters = sizeof(BeamProperties) / sizeof(double);
  static constexpr bool with_coordinates = true;

  static std::string fault(std::span<const double> parameters);
  static int port_coordinates(std::span<const double> parameters);
  static Beam make(const RigidBody<double>& link, std::span<const double> parameters);

  int n_coordinates() const { return modes->n; }
  double stiffness(int k) const { return modes->stiffness[k]; }
  double damping(int k) const { return modes->damping[k]; }
  const ElasticShape* port() const { return &modes->port; }
  const Transform<double>& to_port_base() const { return to_beam; }

  std::shared_ptr<const BeamModes> modes;  ///< equal beams share them
  Transform<double> to_beam;               ///< body's frame -> the beam's
  RigidBody<double> straight;              ///< the beam as if rigid
};

// Straight and resting, it is a rigid body.
inline double mass(const Beam& beam) { return mass(beam.straight); }
template <class S>
LW_INLINE Force<S> inertia_times(const Beam& beam, const Motion<S>& a) {
  return inertia_times(beam.straight, a);
}
template <class S>
LW_INLINE Force<S> momentum(const Beam& beam, const Motion<S>& v) {
  return momentum(beam.straight, v);
}
template <class S>
LW_INLINE Force<S> momentum_bias(const Beam& beam, const Motion<S>& v) {
  return momentum_bias(beam.straight, v);
}
inline double kinetic_energy(const Beam& beam, const Motion<double>& v) {
  return kinetic_energy(beam.straight, v);
}
inline double potential_energy(const Beam& beam, const Transform<double>& X,
                               const Vec3<double>& g) {
  return potential_energy(beam.straight, X, g);
}
template <class S>
LW_INLINE void add_inertia(ArticulatedInertia<S>& Y, const Beam& beam) {
  add_inertia(Y, beam.straight);
}
inline const Inertia<double>& frozen_inertia(const Beam& beam) { return beam.straight.inertia; }
inline Compliance<double> compliance(const Beam& beam) { return compliance(beam.straight); }
template <class From>
Matrix6<double> compliance(const Beam& beam, const From& from, const Transform<double>& X) {
  return compliance(beam.straight, from, X);
}
inline Beam moved(const Beam& beam, const Transform<double>& X) {
  return {beam.modes, beam.to_beam * X, moved(beam.straight, X)};
}

namespace beam {

/// What the coordinates make of one point of the centre line.
template <class S>
struct Point {
  S along[most_coordinates];  ///< how far along x each coordinate's rate moves it
  Vec3<S> r;                  ///< where it is, in the beam's axes
  Vec3<S> rate;               ///< relative to them
  S bow;                      ///< along x, what rates take: - xi^T H xi
};

template <class S>
LW_INLINE Point<S> point(const BeamModes& of, const BeamModes::Station& at, const OwnState<S>& own,
                         const S* rates) {
  Point<S> out;
  out.r = {at.x + S{}, S{}, S{}};
  out.rate = {};
  out.bow = S{};
  if (of.stretches) {
    out.along[0] = at.stretch + S{};
    out.r.x += at.stretch * own.q[0];
    out.rate.x += at.stretch * rates[0];
  }
  out.along[of.twist()] = S{};
  for (int p = 0; p < 2; ++p) {
    const int first = of.first(p);
    S deflection{}, speed{}, taken{};
    for (int i = 0; i < of.in_plane; ++i) {
      S h{}, dh{};
      for (int j = 0; j < of.in_plane; ++j) {
        const double H = at.H[p][i >= j ? packed(i, j) : packed(j, i)];
        h += H * own.q[first + j];
        dh += H * rates[first + j];
      }
      out.along[first + i] = -h;
      taken += h * own.q[first + i];
      out.rate.x -= h * rates[first + i];
      out.bow -= dh * rates[first + i];
      deflection += at.shape[p][i] * own.q[first + i];
      speed += at.shape[p][i] * rates[first + i];
    }
    out.r.x -= 0.5 * taken;
    (p == 0 ? out.r.y : out.r.z) = deflection;
    (p == 0 ? out.rate.y : out.rate.z) = speed;
  }
  return out;
}

/// Adds a station's mass to the blocks, in the beam's axes.
template <class S>
LW_INLINE void add_station(const BeamModes& of, const BeamModes::Station& at, const Point<S>& here,
                           const Motion<S>& v, Inertia<S>& M, OwnEquations<S>& out) {
  const double m = at.mass;
  const Vec3<S>& r = here.r;
  const Vec3<S> speed = v.lin + cross(v.ang, r) + here.rate;
  Vec3<S> f = cross(v.ang, speed + here.rate);
  f.x += here.bow;
  f = m * f;
  out.p.lin += f;
  out.p.ang += cross(r, f);
  M.mc += m * r;
  M.I.m[0] += m * (r.y * r.y + r.z * r.z);
  M.I.m[1] -= m * (r.x * r.y);
  M.I.m[2] += m * (r.x * r.x + r.z * r.z);
  M.I.m[3] -= m * (r.x * r.z);
  M.I.m[4] -= m * (r.y * r.z);
  M.I.m[5] += m * (r.x * r.x + r.y * r.y);
  for (int k = 0; k < of.n; ++k) {
    if (k == of.twist()) continue;
    const S a = m * here.along[k];
    Force<S>& column = out.M_e[k];
    column.lin.x += a;
    column.ang.y += r.z * a;
    column.ang.z -= r.y * a;
    out.p_e[k] += here.along[k] * f.x;
    for (int l = 0; l <= k; ++l)
      if (l != of.twist()) out.m_e[packed(k, l)] += a * here.along[l];
  }
  for (int i = 0; i < of.in_plane; ++i) {
    const int y = of.first(0) + i, z = of.first(1) + i;
    const double shape_y = at.shape[0][i], shape_z = at.shape[1][i];
    out.M_e[y].ang.x -= (m * shape_y) * r.z;
    out.M_e[y].ang.z += (m * shape_y) * r.x;
    out.M_e[z].ang.x += (m * shape_z) * r.y;
    out.M_e[z].ang.y -= (m * shape_z) * r.x;
    out.p_e[y] += shape_y * f.y;
    out.p_e[z] += shape_z * f.z;
  }
}

}  // namespace beam

template <class S>
void calc_equations(const Beam& beam, const Motion<S>& v_frame, const OwnState<S>& own,
                    OwnEquations<S>& out) {
  const BeamModes& of = *beam.modes;
  const Motion<S> v = beam.to_beam * v_frame;
  S rates[most_coordinates];
  for (int k = 0; k < of.n; ++k) rates[k] = own.rate(k);
  Inertia<S> M;
  M.m = broadcast<S>(beam.straight.inertia.m);
  Vec3<S> spin = of.rotary * v.ang;  // of the sections about their centres
  for (int i = 0; i < 6; ++i) M.I.m[i] += of.rotary.m[i];
  for (int k = 0; k < of.n; ++k) {
    const Vec3<double>& side = of.rotary_side[k];
    const Vec3<double>& lateral = of.lateral[k];
    out.M_e[k] = {{S{}, lateral.y + S{}, lateral.z + S{}},
                  {side.x + S{}, side.y + S{}, side.z + S{}}};
    out.p_e[k] = S{};
    spin += rates[k] * side;
  }
  for (int i = 0; i < of.n * (of.n + 1) / 2; ++i) out.m_e[i] = of.m_e[i] + S{};
  out.p = {};
  out.p.ang = cross(v.ang, spin);
  for (const BeamModes::Station& at : of.stations)
    beam::add_station(of, at, beam::point(of, at, own, rates), v, M, out);
  ArticulatedInertia<S> here{};
  add_inertia(here, M);
  out.M = transform_to_parent(beam.to_beam, here);
  out.p = transpose_times(beam.to_beam, out.p);
  for (int k = 0; k < of.n; ++k) out.M_e[k] = transpose_times(beam.to_beam, out.M_e[k]);
}

}  // namespace linkwise
