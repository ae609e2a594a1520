// Uses the body kind of body_with_coordinates.patch: an arm with a mass on a spring inside, against
// the same machine with the mass as a link of its own on a prismatic joint. Prints what is wrong,
// if anything. tests/tools/test_extending.py compiles it with the patched sources and runs it.
#include <cmath>
#include <cstdio>
#include <vector>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/dynamics/mobility.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/forces/passive.hpp"

namespace linkwise {

std::span<const DynamicsEntry> dynamics_table() {
  static const DynamicsEntry table[] = {
      {.name = "any", .any_body = true, .linear_time = true},
      {.name = "own", .any_body = true, .own_coordinates = true, .linear_time = true}};
  return table;
}

}  // namespace linkwise

using namespace linkwise;

namespace {

int failures = 0;
void expect_near(const char* what, double found, double wanted, double tolerance = 1e-12) {
  if (std::abs(found - wanted) <= tolerance * (1 + std::abs(wanted))) return;
  std::printf("%s: %.17g, not %.17g\n", what, found, wanted);
  ++failures;
}

constexpr double m = 0.7, stiffness = 30, damping = 0.4;
const Vec3<double> r0{0.1, -0.2, 0.3}, e{0.6, 0, 0.8};

/// base - yaw - upper - roll - arm - bend - hand: the arm has neighbours on both sides, on hinges
/// and on a general joint.
ModelSpec machine(bool inside) {
  ModelSpec spec;
  spec.gravity = {0.3, -0.5, -9.81};
  spec.links = {{"base"},
                {"upper", 3, {0, 0.1, 0.2}, {{1, 0, 1.2, 0, 0, 0.5}}},
                {"arm", 2, {0.1, 0, 0.2}, {{0.4, 0, 0.5, 0, 0, 0.3}}},
                {"hand", 0.5, {0, 0, 0.1}, {{0.1, 0, 0.2, 0, 0, 0.15}}}};
  spec.joints = {{"yaw", JointType::universal, "base", "upper"},
                 {"roll", JointType::revolute, "upper", "arm"},
                 {"bend", JointType::revolute, "arm", "hand"}};
  spec.joints[0].axes = {{AxisKind::revolute, {0, 0, 1}}, {AxisKind::revolute, {1, 0, 0}}};
  spec.joints[1].axes = {{AxisKind::revolute, {0.6, 0.8, 0}}};
  spec.joints[1].translation = {0.1, 0.2, 0.4};
  spec.joints[2].axes = {{AxisKind::revolute, {0, 1, 0}}};
  spec.joints[2].translation = {0, 0.1, 0.5};
  if (inside) {
    spec.links[2].body_kind = BodyKinds::kind_of<ShakenBody>();
    spec.links[2].parameters = {m, stiffness, damping, r0.x, r0.y, r0.z, e.x, e.y, e.z};
  } else {
    spec.links.push_back({"mass", m, {}, {{1e-13, 0, 1e-13, 0, 0, 1e-13}}});
    spec.joints.push_back({"slide", JointType::prismatic, "arm", "mass"});
    spec.joints[3].axes = {{AxisKind::prismatic, e}};
    spec.joints[3].translation = r0;
    spec.joints[3].dof = {{DofProperty::stiffness, {stiffness}}, {DofProperty::damping, {damping}}};
  }
  return spec;
}

SweepInput<double> input(const double* q, const double* v, const double* tau) {
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  in.tau = tau;
  return in;
}

/// Coordinate 4, the last one, is the mass's on both machines.
void compare(const Model& model, const Model& twin) {
  const std::vector<double> q = {0.3, -0.5, 0.7, 1.1, 0.15}, v = {0.7, 1.3, -0.4, 0.9, -1.2};
  const std::vector<double> tau = {1, -2, 0.5, 0.3, 0.8};
  std::vector<double> external(18);
  for (size_t i = 0; i < external.size(); ++i) external[i] = 0.1 * static_cast<double>(i) - 0.7;
  std::vector<double> of_twin = external;
  of_twin.resize(24);
  const auto at = [&](const double* rates, const std::vector<double>& torque, bool is_twin) {
    SweepInput<double> in = input(q.data(), rates, torque.data());
    in.external = is_twin ? of_twin.data() : external.data();
    return in;
  };
  ArticulatedBody<double> recursion(model), other(twin);
  std::vector<double> du(5), want(5), loads(18), want_loads(24);
  const auto same = [&](const char* what) {
    for (int i = 0; i < 5; ++i) expect_near(what, du[i], want[i], 1e-11);
    for (int i = 0; i < 18; ++i) expect_near(what, loads[i], want_loads[i], 1e-11);
  };
  recursion.evaluate(at(v.data(), tau, false), du.data(), loads.data());
  other.evaluate(at(v.data(), tau, true), want.data(), want_loads.data());
  same("forward dynamics");
  recursion.evaluate_again(at(nullptr, tau, false), du.data(), loads.data());
  other.evaluate_again(at(nullptr, tau, true), want.data(), want_loads.data());
  same("again, at rest");
  recursion.evaluate_again(at(v.data(), tau, false), du.data(), loads.data());
  other.evaluate_again(at(v.data(), tau, true), want.data(), want_loads.data());
  same("again, moving");

  std::vector<double> found(5), held(18);
  InverseDynamics<double>(model).evaluate(at(v.data(), tau, false), du.data(), found.data(),
                                          held.data());
  for (int i = 0; i < 5; ++i) expect_near("inverse dynamics", found[i], tau[i], 1e-11);
  for (int i = 0; i < 18; ++i) expect_near("its loads", held[i], loads[i], 1e-11);

  using Two = Lanes<2>;
  std::vector<Two> q2(5), v2(5), tau2(5), du2(5), external2(18);
  for (int i = 0; i < 5; ++i) {
    q2[i] = broadcast<Two>(q[i]);
    v2[i] = broadcast<Two>(v[i]);
    tau2[i] = broadcast<Two>(tau[i]);
  }
  for (int i = 0; i < 18; ++i) external2[i] = broadcast<Two>(external[i]);
  SweepInput<Two> lanes;
  lanes.q = q2.data();
  lanes.v = v2.data();
  lanes.tau = tau2.data();
  lanes.external = external2.data();
  ArticulatedBody<Two>(model).evaluate(lanes, du2.data(), nullptr);
  for (int i = 0; i < 5; ++i) expect_near("on lanes", lane(du2[i], 1), du[i]);

  expect_near("kinetic energy", kinetic_energy(model, q.data(), v.data()),
              kinetic_energy(twin, q.data(), v.data()), 1e-11);
  expect_near("potential energy", potential_energy(model, q.data()),
              potential_energy(twin, q.data()));
  double h[6], want_h[6];
  momentum(model, q.data(), v.data(), h);
  momentum(twin, q.data(), v.data(), want_h);
  for (int i = 0; i < 6; ++i) expect_near("momentum", h[i], want_h[i], 1e-11);
  std::vector<double> passive(5), want_passive(5);
  add_passive_forces(model, q.data(), v.data(), passive.data());
  add_passive_forces(twin, q.data(), v.data(), want_passive.data());
  expect_near("spring and damper", passive[4], want_passive[4]);
  expect_near("spring and damper", passive[4], -stiffness * q[4] - damping * v[4]);
  Mobility mobility(model), other_mobility(twin);
  const auto yields = mobility.evaluate(q.data()), want_yields = other_mobility.evaluate(q.data());
  for (int i = 0; i < 5; ++i) expect_near("mobility", yields[i], want_yields[i], 1e-9);
}

template <class F>
void expect_error(F&& f, const std::string& wanted) {
  std::string found;
  try {
    f();
  } catch (const InputError& error) {
    found = error.what();
  }
  if (found == wanted) return;
  std::printf("'%s' instead of '%s'\n", found.c_str(), wanted.c_str());
  ++failures;
}

}  // namespace

int main() {
  const Model model(deserialize(serialize(machine(true)))), twin(machine(false));
  if (model.nq() != 5 || model.nv() != 5) return std::puts("it has no coordinate of its own"), 1;
  compare(model, twin);
  require_known_bodies(model, dynamics_table()[1]);
  expect_error([&] { require_known_bodies(model, dynamics_table()[0]); },
               "body 'arm' is of kind shaken, which method any does not take; use one of own");
  return failures;
}
