// The chain in pieces against the plain recursion, at lengths around multiples of the pieces and
// lanes, with axes of every kind, and to the last bit for any number of threads.
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/piecewise.hpp"

namespace linkwise {
namespace {

enum class Axes { random, parallel, nearly_parallel };

ModelSpec revolute_chain_spec(int n, Axes axes, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  ModelSpec spec;
  LinkSpec ground;
  ground.name = "ground";
  spec.links.push_back(ground);
  for (int i = 0; i < n; ++i) {
    LinkSpec link;
    link.name = "link_" + std::to_string(i);
    link.mass = 0.5 + std::abs(normal(generator));
    link.com = {0.1, 0.05 * normal(generator), -0.5};
    link.inertia = {{0.1, 0.01, 0.12, 0, 0, 0.03}};
    JointSpec joint;
    joint.name = "joint_" + std::to_string(i);
    joint.parent = spec.links.back().name;
    joint.child = link.name;
    joint.translation = {0.2, 0, -1};
    const double tilt = axes == Axes::random ? 1 : axes == Axes::parallel ? 0 : 1e-3;
    joint.axes = {{AxisKind::revolute, {tilt * normal(generator), 1, tilt * normal(generator)}, 0}};
    spec.links.push_back(link);
    spec.joints.push_back(joint);
  }
  return spec;
}

Model make_revolute_chain(int n, Axes axes, unsigned seed) {
  return Model(revolute_chain_spec(n, axes, seed));
}

struct Result {
  std::vector<double> du, loads;
};

struct State {
  std::vector<double> q, v, tau, external;
  State(int n, unsigned seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (auto* x : {&q, &v, &tau})
      for (int i = 0; i < n; ++i) x->push_back(uniform(generator));
    for (int i = 0; i < 6 * n; ++i) external.push_back(uniform(generator));
  }
  SweepInput<double> input() const {
    SweepInput<double> in;
    in.q = q.data();
    in.v = v.data();
    in.tau = tau.data();
    in.external = external.data();
    return in;
  }
};

Result run(const Model& model, const State& state, int threads) {
  DynamicsOptions options;
  options.executor = Executor(threads);
  Piecewise method(model, options);
  Result out{std::vector<double>(model.nv()), std::vector<double>(6 * model.n_joints())};
  const DynamicsReport report = method.evaluate(0, state.input(), out.du.data(), out.loads.data());
  EXPECT_TRUE(report.ok());
  return out;
}

double relative_error(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = 0, scale = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    worst = std::max(worst, std::abs(a[i] - b[i]));
    scale = std::max(scale, std::abs(b[i]));
  }
  return worst / scale;
}

class PiecewiseLengths : public testing::TestWithParam<int> {};

TEST_P(PiecewiseLengths, EqualTheRecursion) {
  const int n = GetParam();
  for (Axes axes : {Axes::random, Axes::parallel, Axes::nearly_parallel}) {
    const Model model = make_revolute_chain(n, axes, 7);
    const State state(n, 11);
    ArticulatedBody<double> recursion(model);
    Result expected{std::vector<double>(n), std::vector<double>(6 * n)};
    ASSERT_TRUE(recursion.evaluate(state.input(), expected.du.data(), expected.loads.data()));
    const Result actual = run(model, state, 1);
    // Parallel hinges are the ill-conditioned kind: rounding grows with the length.
    const double bound = axes == Axes::random ? 1e-11 : 1e-8;
    EXPECT_LT(relative_error(actual.du, expected.du), bound) << "axes " << static_cast<int>(axes);
    EXPECT_LT(relative_error(actual.loads, expected.loads), bound);
  }
}

INSTANTIATE_TEST_SUITE_P(Awkward, PiecewiseLengths,
                         testing::Values(16, 17, 23, 24, 25, 31, 33, 63, 64, 65, 127, 200, 300));

TEST(PiecewiseThreads, SameBits) {
  for (int n : {64, 257, 5000}) {
    const Model model = make_revolute_chain(n, Axes::random, 3);
    const State state(n, 5);
    const Result one = run(model, state, 1);
    for (int threads : {2, 3, 7}) {
      const Result several = run(model, state, threads);
      EXPECT_EQ(one.du, several.du) << n << " bodies on " << threads << " threads";
      EXPECT_EQ(one.loads, several.loads);
    }
  }
}

TEST(Piecewise, RefusesWhatItCannotTake) {
  const Model model = make_revolute_chain(8, Axes::random, 1);
  EXPECT_FALSE(Piecewise::suits(model));
  EXPECT_THROW(Piecewise(model, {}), InputError);
}

TEST(Piecewise, NamesTheBodyWithASingularInertia) {
  ModelSpec spec = revolute_chain_spec(20, Axes::random, 1);
  spec.links[8].inertia = {};
  const Model model(spec);
  EXPECT_FALSE(Piecewise::suits(model));
  try {
    Piecewise(model, {});
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("body 'link_7' has a singular inertia, which method piecewise cannot take"),
              std::string::npos)
        << text;
  }
}

}  // namespace
}  // namespace linkwise
