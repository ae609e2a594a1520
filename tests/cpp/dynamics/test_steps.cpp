// The steps by themselves: with another kind of body, which shows what a body has to answer, and
// swept by hand, which shows that they need no schedule of the core.

#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/recursion/steps.hpp"

namespace linkwise {

/// A body kind of this test alone: points of mass, rigidly joined.
struct PointCloud {
  struct Point {
    double mass;
    Vec3<double> at;
  };
  std::vector<Point> points;
};

template <class S>
Force<S> inertia_times(const PointCloud& body, const Motion<S>& v) {
  Force<S> h{};
  for (const auto& p : body.points) {
    const Vec3<S> moved = p.mass * (v.lin + cross(v.ang, p.at));
    h += Force<S>{moved, cross(p.at, moved)};
  }
  return h;
}

template <class S>
Force<S> momentum_bias(const PointCloud& body, const Motion<S>& v) {
  return cross_dual(v, inertia_times(body, v));
}

template <class S>
void add_inertia(ArticulatedInertia<S>& Y, const PointCloud& body) {
  for (const auto& p : body.points) {
    const Vec3<double>& r = p.at;
    const double m = p.mass;
    add_inertia(Y, Inertia<double>{
                       m,
                       m * r,
                       {{m * (r.y * r.y + r.z * r.z), -m * r.x * r.y, m * (r.x * r.x + r.z * r.z),
                         -m * r.x * r.z, -m * r.y * r.z, m * (r.x * r.x + r.y * r.y)}}});
  }
}

namespace testing {
namespace {

PointCloud random_cloud(Draws& draws) {
  PointCloud cloud;
  for (int i = 0; i < 5; ++i)
    cloud.points.push_back({draws.uniform(0.2, 1), random_vector3(draws, 0.4)});
  return cloud;
}

Inertia<double> rigid(const PointCloud& cloud) {
  ArticulatedInertia<double> Y;
  add_inertia(Y, cloud);
  return {Y.A.m[0], {Y.B.m[5], Y.B.m[6], Y.B.m[1]}, Y.C};
}

/// A revolute chain of any bodies; du and the joint loads by both sweeps of loads.
template <class Body>
struct Chain {
  const Model& model;
  std::vector<Body> bodies;

  Transform<double> pose(int n, const double* q) const {
    return RevoluteJoint::pose(model.constants[n].tree, 0.0, q[n]);
  }

  void evaluate(const SweepInput<double>& in, std::vector<double>& du,
                std::vector<Force<double>>& outward, std::vector<Force<double>>& inward) const {
    using J = RevoluteJoint;
    const int n_bodies = static_cast<int>(bodies.size());
    std::vector<Transform<double>> X(n_bodies);
    std::vector<Motion<double>> v(n_bodies), a(n_bodies);
    std::vector<Force<double>> bias(n_bodies), pa(n_bodies);
    std::vector<EliminatedAxis<double>> axis(n_bodies);
    std::vector<PlanarInertia<double>> Ya(n_bodies);
    for (int n = 0; n < n_bodies; ++n) {
      X[n] = pose(n, in.q);
      v[n] = outward_velocity<J>(linkwise::Pose<double>{X[n]}, n > 0 ? v[n - 1] : Motion<double>{},
                                 0.0, in.v[n]);
      bias[n] = momentum_bias(bodies[n], v[n]);
    }
    Contribution<double> outer{};
    for (int n = n_bodies - 1; n >= 0; --n) {
      add_inertia(outer.Y, bodies[n]);
      outer.p += bias[n];
      EXPECT_GT(eliminate<J>(outer.Y, outer.p, 0.0, NoRotor{}, in.tau[n], axis[n]), 0);
      reduce<J>(outer.Y, axis[n], J::bias(v[n], 0.0, in.v[n]), Ya[n], outer.p);
      pa[n] = outer.p;
      const linkwise::Pose<double> place{X[n]};
      outer = {place.to_parent(Ya[n]), place.to_parent(pa[n])};
    }
    for (int n = 0; n < n_bodies; ++n) {
      a[n] = X[n] * (n > 0 ? a[n - 1] : ground_acceleration<double>(model, 1));
      outward[n] = outward_load(Ya[n], pa[n], a[n]);
      du[n] = accelerate<J>(axis[n], J::bias(v[n], 0.0, in.v[n]), 0.0, a[n]);
    }
    Force<double> w{};
    for (int n = n_bodies - 1; n >= 0; --n) {
      inward_load(bodies[n], a[n], bias[n], w);
      inward[n] = w;
      w = transpose_times(X[n], w);
    }
  }
};

TEST(Steps, TakeAnyBodyThatAnswersThem) {
  Draws draws(91);
  constexpr int n_bodies = 6;
  Model model(
      tree_spec(std::vector(n_bodies, JointType::revolute), chain_parents(n_bodies), draws));
  Chain<PointCloud> clouds{model, {}};
  for (int n = 0; n < n_bodies; ++n) {
    clouds.bodies.push_back(random_cloud(draws));
    model.constants[n].rigid = {rigid(clouds.bodies[n])};
  }
  const MachineState state = random_state(model, draws);
  const std::vector<double> tau = random_values(n_bodies, draws, 5);
  SweepInput<double> in;
  in.q = state.q.data();
  in.v = state.v.data();
  in.tau = tau.data();
  std::vector<double> want(n_bodies), want_loads(6 * n_bodies), du(n_bodies);
  ArticulatedBody<double> recursion(model);
  ASSERT_TRUE(recursion.evaluate(in, want.data(), want_loads.data()));
  std::vector<Force<double>> outward(n_bodies), inward(n_bodies);
  clouds.evaluate(in, du, outward, inward);
  std::vector<double> loads[2];
  for (int which : {0, 1}) {
    loads[which].resize(6 * n_bodies);
    store_joint_loads(
        model, in.q, [&](int n) { return (which == 0 ? outward : inward)[n]; },
        loads[which].data());
    expect_close(loads[which], want_loads, 1e-11, which == 0 ? "outward" : "inward");
  }
  expect_close(du, want, 1e-11, "accelerations");
}

}  // namespace
}  // namespace testing
}  // namespace linkwise
