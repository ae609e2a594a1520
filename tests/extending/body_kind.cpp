// Uses the body kind of body_kind.patch: a spinning wheel on a turntable. Prints what is wrong, if
// anything. tests/tools/test_extending.py compiles it with the patched sources and runs it.
#include <cmath>
#include <cstdio>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Two methods, one of which takes rigid bodies alone.
std::span<const DynamicsEntry> dynamics_table() {
  static const DynamicsEntry table[] = {{.name = "narrow", .linear_time = true},
                                        {.name = "wide", .any_body = true, .linear_time = true}};
  return table;
}

}  // namespace linkwise

using namespace linkwise;

namespace {

int failures = 0;
void expect_near(const char* what, double found, double wanted) {
  if (std::abs(found - wanted) <= 1e-12 * (1 + std::abs(wanted))) return;
  std::printf("%s: %.17g, not %.17g\n", what, found, wanted);
  ++failures;
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

/// A table that turns about the vertical carries an arm that turns about its own x, which lies
/// level; the arm's y is vertical, and about its z a wheel spins with momentum h.
ModelSpec spinning_wheel(double h) {
  ModelSpec spec;
  spec.links = {
      {"ground"}, {"table", 3, {}, {{1, 0, 1, 0, 0, 2}}}, {"arm", 2, {}, {{2, 0, 1, 0, 0, 3}}}};
  spec.links[2].body_kind = BodyKinds::kind_of<Gyrostat>();
  spec.links[2].parameters = {0, 0, h};
  spec.joints = {{"yaw", JointType::revolute, "ground", "table"},
                 {"pitch", JointType::revolute, "table", "arm"}};
  spec.joints[0].axes = {{AxisKind::revolute, {0, 0, 1}}};
  spec.joints[1].axes = {{AxisKind::revolute, {1, 0, 0}}};
  spec.joints[1].rotation = {{0, 0, 1, 1, 0, 0, 0, 1, 0}};
  return spec;
}

}  // namespace

int main() {
  const double h = 5, yaw = 0.7;
  const Model model(deserialize(serialize(spinning_wheel(h))));
  const double q[] = {0.3, 0}, v[] = {yaw, 0}, tau[] = {0, 0};
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  in.tau = tau;
  double du[2], loads[12];

  // The gyroscopic moment -(yaw y) x (h z) = -yaw h x turns the arm, whose inertia is 2.
  ArticulatedBody<double> recursion(model);
  if (!recursion.evaluate(in, du, loads)) return std::puts("the recursion failed"), 1;
  expect_near("yaw acceleration", du[0], 0);
  expect_near("pitch acceleration", du[1], -yaw * h / 2);
  // On lanes the same.
  using Two = Lanes<2>;
  const Two q2[] = {Two{q[0], q[0]}, Two{q[1], q[1]}}, v2[] = {Two{v[0], v[0]}, Two{v[1], v[1]}};
  const Two tau2[] = {Two{}, Two{}};
  SweepInput<Two> lanes;
  lanes.q = q2;
  lanes.v = v2;
  lanes.tau = tau2;
  Two du2[2];
  ArticulatedBody<Two>(model).evaluate(lanes, du2, nullptr);
  expect_near("on lanes", lane(du2[1], 1), du[1]);
  // Holding the arm takes the opposite.
  double held[2];
  const double none[] = {0, 0};
  InverseDynamics<double>(model).evaluate(in, none, held, nullptr);
  expect_near("torque that holds the arm", held[1], yaw * h);

  require_known_bodies(model, dynamics_table()[1]);
  expect_error([&] { require_known_bodies(model, dynamics_table()[0]); },
               "body 'arm' is of kind gyrostat, which method narrow does not take; use one of "
               "wide");
  ModelSpec spec = spinning_wheel(h);
  spec.links[2].parameters = {h};
  expect_error([&] { Model{spec}; }, "link 'arm': body kind gyrostat takes 3 parameters, not 1");
  spec = spinning_wheel(h);
  spec.joints[1].type = JointType::fixed;
  // Only rigid bodies become one by a weld.
  expect_near("bodies, one welded", Model(spec).n_bodies(), model.n_bodies());
  return failures;
}
