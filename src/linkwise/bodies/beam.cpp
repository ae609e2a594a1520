#include "linkwise/bodies/beam.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>

#include "linkwise/base/symmetric_eigen.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

constexpr int most = BeamModes::most_in_plane;

/// Nodes and weights of Gauss's quadrature on [0, 1], exact for degree 2 n - 1.
void gauss(int n, double* node, double* weight) {
  for (int i = 0; i < n; ++i) {
    double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int round = 0; round < 20; ++round) {
      double before = 1, value = x;
      for (int k = 1; k < n; ++k) {
        const double next = ((2 * k + 1) * x * value - k * before) / (k + 1);
        before = value;
        value = next;
      }
      slope = n * (x * value - before) / (x * x - 1);
      x -= value / slope;
    }
    node[n - 1 - i] = 0.5 * (1 + x);
    weight[n - 1 - i] = 1 / ((1 - x * x) * slope * slope);
  }
}

/// Legendre's polynomials on [0, 1], integrated twice from 0: what bends the beam by one of them.
/// Bending stiffness is diagonal in these, 1 / (2 k + 1), and from the third on they vanish at both
/// ends, with their slopes.
void bent_by_legendre(double out[most][most + 2]) {
  double legendre[most][most] = {{1}, {-1, 2}};
  for (int k = 1; k + 1 < most; ++k)
    for (int j = 0; j <= k + 1; ++j) {
      const double shifted = (j > 0 ? 2 * legendre[k][j - 1] : 0) - legendre[k][j];
      legendre[k + 1][j] =
          ((2 * k + 1) * shifted - k * (j < most ? legendre[k - 1][j] : 0)) / (k + 1);
    }
  for (int k = 0; k < most; ++k)
    for (int j = 0; j < most; ++j) out[k][j + 2] = legendre[k][j] / ((j + 1.0) * (j + 2.0));
}

double value(const double* polynomial, double x, int derivative) {
  double sum = 0;
  for (int j = most + 1; j >= derivative; --j) {
    double factor = polynomial[j];
    for (int d = 0; d < derivative; ++d) factor *= j - d;
    sum = sum * x + factor;
  }
  return sum;
}

}  // namespace

double BeamModes::shape(int p, int k, double x, int derivative) const {
  return value(plane[p].polynomial[k], x / of.length, derivative) / std::pow(of.length, derivative);
}

/// Modes of the clamped beam among the polynomials: K phi = omega^2 M phi, where K is diagonal.
void BeamModes::find_modes(int p, double EI, double rotary_inertia) {
  const int count = in_plane;
  const double L = of.length;
  double basis[most][most + 2] = {}, node[most + 3], weight[most + 3];
  bent_by_legendre(basis);
  gauss(most + 3, node, weight);
  double mass[most * (most + 1) / 2] = {};
  for (int g = 0; g < most + 3; ++g)
    for (int i = 0; i < count; ++i)
      for (int j = 0; j <= i; ++j)
        mass[packed(i, j)] +=
            weight[g] *
            (of.mass_per_length * L * value(basis[i], node[g], 0) * value(basis[j], node[g], 0) +
             rotary_inertia / L * value(basis[i], node[g], 1) * value(basis[j], node[g], 1));
  // With y = K^(1/2) phi: M' y = omega^-2 y, whose largest eigenvalues, the lowest modes, are the
  // most exact.
  double a[most * most] = {}, vectors[most * most], values[most], root[most];
  for (int i = 0; i < count; ++i) root[i] = std::sqrt((2 * i + 1) * L * L * L / EI);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      a[most * i + j] = root[i] * root[j] * mass[i >= j ? packed(i, j) : packed(j, i)];
  symmetric_eigen<most>(count, a, values, vectors);
  int order[most];
  for (int i = 0; i < count; ++i) order[i] = i;
  std::sort(order, order + count, [&](int i, int j) { return values[i] > values[j]; });
  for (int k = 0; k < count; ++k) {
    double mode[most + 2] = {};
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < most + 2; ++j)
        mode[j] += root[i] * vectors[most * i + order[k]] * basis[i][j];
    double largest = 0;
    for (int s = 0; s <= 100; ++s) largest = std::max(largest, std::abs(value(mode, s / 100.0, 0)));
    if (value(mode, 1, 0) < 0) largest = -largest;
    for (int j = 0; j < most + 2; ++j) plane[p].polynomial[k][j] = mode[j] / largest;
    const double omega = 1 / std::sqrt(values[order[k]]), k_k = 1 / (largest * largest);
    stiffness[first(p) + k] = k_k;
    damping[first(p) + k] = 2 * of.damping_ratio * k_k / omega;
  }
}

BeamModes::Station BeamModes::station(double x) const {
  Station out{};
  out.x = x;
  out.stretch = x / of.length;
  constexpr int n_nodes = most + 1;  // slopes have degree most
  double node[n_nodes], weight[n_nodes];
  gauss(n_nodes, node, weight);
  for (int p = 0; p < 2; ++p)
    for (int i = 0; i < in_plane; ++i) {
      out.shape[p][i] = shape(p, i, x);
      for (int j = 0; j <= i; ++j)
        for (int g = 0; g < n_nodes; ++g)
          out.H[p][packed(i, j)] +=
              weight[g] * x * shape(p, i, node[g] * x, 1) * shape(p, j, node[g] * x, 1);
    }
  return out;
}

std::vector<BeamModes::Station> BeamModes::stations_from(double x) const {
  // The highest degree is that of energy along x, twice that of H, 2 n + 1.
  const int count = 2 * in_plane + 2;
  std::vector<double> node(count), weight(count);
  gauss(count, node.data(), weight.data());
  std::vector<Station> out;
  const double rest = of.length - x;
  for (int g = 0; g < count && rest > 0; ++g) {
    out.push_back(station(x + rest * node[g]));
    out.back().mass = of.mass_per_length * rest * weight[g];
  }
  return out;
}

void BeamModes::integrate() {
  const double L = of.length;
  stations = stations_from(0);
  rotary = {{of.rotary_y + of.rotary_z, 0, of.rotary_y, 0, 0, of.rotary_z}};
  for (double& x : rotary.m) x *= L;
  rotary_side.assign(n, {});
  lateral.assign(n, {});
  m_e.assign(n * (n + 1) / 2, 0.0);
  rotary_side[twist()].x = (of.rotary_y + of.rotary_z) * L / 2;
  m_e[packed(twist(), twist())] = (of.rotary_y + of.rotary_z) * L / 3;
  for (const Station& at : stations) {
    const double share = at.mass / of.mass_per_length;  // of the length
    for (int p = 0; p < 2; ++p)
      for (int i = 0; i < in_plane; ++i) {
        const int k = first(p) + i;
        const double rotary_p = p == 0 ? of.rotary_z : of.rotary_y;
        const double slope = shape(p, i, at.x, 1);
        (p == 0 ? lateral[k].y : lateral[k].z) += at.mass * at.shape[p][i];
        (p == 0 ? rotary_side[k].z : rotary_side[k].y) +=
            (p == 0 ? rotary_p : -rotary_p) * share * slope;
        for (int j = 0; j <= i; ++j)
          m_e[packed(k, first(p) + j)] += at.mass * at.shape[p][i] * at.shape[p][j] +
                                          rotary_p * share * slope * shape(p, j, at.x, 1);
      }
  }
}

BeamModes::BeamModes(const BeamProperties& given)
    : of(given),
      in_plane(2 + static_cast<int>(given.interior_modes)),
      stretches(given.stretches != 0),
      n(stretches + 1 + 2 * in_plane),
      plane{},
      stiffness(n),
      damping(n) {
  const double L = of.length, rotary_x = of.rotary_y + of.rotary_z;
  const auto set = [&](int k, double stiff, double inertia) {
    stiffness[k] = stiff;
    damping[k] = 2 * of.damping_ratio * std::sqrt(stiff * inertia);
  };
  if (stretches) set(0, of.EA / L, of.mass_per_length * L / 3);
  set(twist(), of.GJ / L, rotary_x * L / 3);
  find_modes(0, of.EIz, of.rotary_z);
  find_modes(1, of.EIy, of.rotary_y);
  integrate();
  const Station end = station(L);
  port.n = n;
  port.rest = {L, 0, 0};
  port.Phi.assign(n, {});
  port.Psi.assign(n, {});
  port.G[0].assign(n * (n + 1) / 2, 0.0);
  if (stretches) port.Phi[0].x = 1;
  port.Psi[twist()].x = 1;
  for (int p = 0; p < 2; ++p)
    for (int i = 0; i < in_plane; ++i) {
      const int k = first(p) + i;
      (p == 0 ? port.Phi[k].y : port.Phi[k].z) = end.shape[p][i];
      (p == 0 ? port.Psi[k].z : port.Psi[k].y) = (p == 0 ? 1 : -1) * shape(p, i, L, 1);
      for (int j = 0; j <= i; ++j) port.G[0][packed(k, first(p) + j)] = -end.H[p][packed(i, j)];
    }
}

namespace {

BeamProperties properties(std::span<const double> parameters) {
  BeamProperties of;
  std::memcpy(&of, parameters.data(), sizeof of);
  return of;
}

}  // namespace

std::string Beam::fault(std::span<const double> parameters) {
  const BeamProperties of = properties(parameters);
  const std::pair<const char*, double> positive[] = {
      {"length", of.length}, {"mass per length", of.mass_per_length},
      {"EA", of.EA},         {"EIy", of.EIy},
      {"EIz", of.EIz},       {"GJ", of.GJ}};
  for (const auto& [name, value] : positive)
    if (!(value > 0))
      return std::string("the beam's ") + name + " is not positive; give a value above 0";
  if (!(of.rotary_y > 0 && of.rotary_z > 0))
    return "the beam's sections have no inertia; give second moments of area above 0";
  if (of.damping_ratio < 0) return "the beam's damping is negative; give a ratio of 0 or more";
  if (of.interior_modes < 0 || of.interior_modes > most_interior_modes ||
      of.interior_modes != std::floor(of.interior_modes))
    return "the beam's interior_modes is not a number from 0 to " +
           std::to_string(most_interior_modes) + "; give one, or more bodies";
  if (of.stretches != 0 && of.stretches != 1)
    return "whether the beam stretches is neither 0 nor 1; give one of them";
  return "";
}

int Beam::port_coordinates(std::span<const double> parameters) {
  const BeamProperties of = properties(parameters);
  return static_cast<int>(of.stretches) + 1 + 2 * (2 + static_cast<int>(of.interior_modes));
}

Beam Beam::make(const RigidBody<double>&, std::span<const double> parameters) {
  const BeamProperties of = properties(parameters);
  Beam out;
  out.modes = std::make_shared<BeamModes>(of);
  const double L = of.length, m = of.mass_per_length * L;
  Mat3<double> axes;
  std::copy(of.axes, of.axes + 9, axes.m);
  out.to_beam = {transpose(axes), {of.start[0], of.start[1], of.start[2]}};
  Inertia<double> straight{m, {m * L / 2, 0, 0}, out.modes->rotary};
  straight.I.m[2] += m * L * L / 3;
  straight.I.m[5] += m * L * L / 3;
  out.straight = {transform_to_parent(out.to_beam, straight)};
  return out;
}

}  // namespace linkwise
