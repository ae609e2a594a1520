#include "linkwise/bodies/modal.hpp"

#include <cmath>
#include <cstring>

#include "linkwise/simd/cholesky.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

constexpr size_t n_head = sizeof(ModalProperties) / sizeof(double);

ModalProperties modal_properties(std::span<const double> parameters) {
  ModalProperties of;
  std::memcpy(&of, parameters.data(), sizeof of);
  return of;
}

/// The next numbers of a list.
class ModalNumbers {
 public:
  explicit ModalNumbers(std::span<const double> given) : at_(given.data()) {}
  double next() { return *at_++; }
  void fill(std::vector<double>& to) {
    for (double& x : to) x = next();
  }
  void fill(std::vector<Vec3<double>>& to) {
    for (Vec3<double>& x : to) {
      x.x = next();
      x.y = next();
      x.z = next();
    }
  }
  void fill(std::vector<Mat3<double>>& to) {
    for (Mat3<double>& x : to)
      for (double& e : x.m) e = next();
  }

 private:
  const double* at_;
};

}  // namespace

ModalShape::ModalShape(std::span<const double> parameters) {
  const ModalProperties of = modal_properties(parameters);
  n = static_cast<int>(of.n);
  m = of.mass;
  mc = {of.mc[0], of.mc[1], of.mc[2]};
  for (int e = 0; e < 6; ++e) N0.m[e] = of.N0[e];
  has_port = of.has_port != 0;
  C.resize(n);
  N_i0.resize(n);
  stiffness.resize(n);
  damping.resize(n);
  N_ij.resize(n * (n + 1) / 2);
  port.n = n;
  port.rest = {of.rest[0], of.rest[1], of.rest[2]};
  port.Phi.resize(n);
  port.Psi.resize(n);
  ModalNumbers numbers(parameters.subspan(n_head));
  numbers.fill(C);
  numbers.fill(N_i0);
  numbers.fill(port.Phi);
  numbers.fill(port.Psi);
  numbers.fill(stiffness);
  numbers.fill(damping);
  numbers.fill(N_ij);
  for (const Mat3<double>& N : N_ij) m_e.push_back(modal::trace(N));
}

std::string ModalBody::fault(std::span<const double> parameters) {
  if (parameters.size() < n_head) return "a modal body has too few parameters; give all of them";
  const ModalProperties of = modal_properties(parameters);
  if (!(of.n >= 1 && of.n <= most_coordinates) || of.n != std::floor(of.n))
    return "the modal body has " + std::to_string(static_cast<long long>(of.n)) +
           " coordinates; give 1 to " + std::to_string(most_coordinates) +
           ", fewer by the argument modes";
  const int n = static_cast<int>(of.n);
  if (parameters.size() != static_cast<size_t>(n_modal_parameters(n)))
    return "a modal body of " + std::to_string(n) + " coordinates takes " +
           std::to_string(n_modal_parameters(n)) + " parameters, not " +
           std::to_string(parameters.size()) + "; give all of them";
  if (of.has_port != 0 && of.has_port != 1)
    return "whether the modal body has a port is neither 0 nor 1; give one of them";
  if (!(of.mass > 0)) return "the modal body's mass is not positive; give one above 0";
  const ModalShape shape(parameters);
  for (int k = 0; k < n; ++k)
    if (shape.stiffness[k] < 0 || shape.damping[k] < 0)
      return "the modal body's stiffness or damping is negative; give 0 or more";
  std::vector<double> factor = shape.m_e;
  for (int k = 0; k < n; ++k)
    if (!(factor[packed(k, k)] > 0))
      return "shape " + std::to_string(k + 1) +
             " of the modal body moves no mass; give shapes that do";
  if (!cholesky_factor(n, factor.data(), 1e-14))
    return "shapes of the modal body are linearly dependent; give fewer, by the argument modes";
  return "";
}

int ModalBody::port_coordinates(std::span<const double> parameters) {
  const ModalProperties of = modal_properties(parameters);
  return of.has_port != 0 ? static_cast<int>(of.n) : 0;
}

ModalBody ModalBody::make(const RigidBody<double>&, std::span<const double> parameters) {
  const ModalProperties of = modal_properties(parameters);
  ModalBody out;
  out.shape = std::make_shared<ModalShape>(parameters);
  Mat3<double> axes;
  std::copy(of.axes, of.axes + 9, axes.m);
  out.to_axes = {transpose(axes), {}};
  const Sym3<double>& N = out.shape->N0;
  const double t = N.m[0] + N.m[2] + N.m[5];
  Inertia<double> straight{of.mass, out.shape->mc, {}};
  for (int e = 0; e < 6; ++e) straight.I.m[e] = -N.m[e];
  for (const int e : {0, 2, 5}) straight.I.m[e] += t;
  out.straight = {transform_to_parent(out.to_axes, straight)};
  return out;
}

}  // namespace linkwise
