// What computes given states: which method, on lanes or one by one, and what is said of failures.
#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/simd/lanes.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

constexpr auto go_on = [] { return true; };

DynamicsOptions asking_for(const std::string& method, const std::string& solver = "auto") {
  DynamicsOptions options = evaluation_options();
  options.method = method;
  options.solver = solver;
  return options;
}

Model arm(int n = 5) {
  Draws draws(31);
  return Model(tree_spec(std::vector(n, revolute), chain_parents(n), draws));
}

/// `count` states and what an evaluator makes of them.
struct Evaluated {
  std::vector<double> q, v, tau, du, loads, force;
  EvaluationReport report;

  Evaluated(const Model& m, size_t count, const DynamicsOptions& options, bool full = false,
            bool passive = false) {
    for (size_t i = 0; i < count; ++i) {
      const DynamicsCase c(m, 100 + i);
      q.insert(q.end(), c.state.q.begin(), c.state.q.end());
      v.insert(v.end(), c.state.v.begin(), c.state.v.end());
      tau.insert(tau.end(), c.tau.begin(), c.tau.end());
    }
    du.assign(count * m.nv(), NAN);
    loads.assign(count * 6 * m.n_joints(), NAN);
    BatchInput in{q.data(), v.data(), tau.data()};
    in.passive_acts = passive;
    report = Evaluator(m).forward_dynamics(
        count, in, options, {du.data(), loads.data(), full ? &force : nullptr}, go_on);
  }
};

TEST(Evaluator, ChoosesByTheStatesAndTheMachine) {
  const Model m = arm(), chain = arm(100);
  EXPECT_EQ(Evaluated(m, 1, asking_for("auto")).report.choice.method, "articulated_body");
  EXPECT_EQ(Evaluated(m, 3, asking_for("auto")).report.choice.method, "articulated_body");
  EXPECT_EQ(Evaluated(chain, 1, asking_for("auto")).report.choice.method, "piecewise");
  EXPECT_EQ(Evaluated(chain, 2, asking_for("auto")).report.choice.method, "articulated_body");
  const Evaluated by_solver(m, 1, asking_for("auto", "conjugate_gradient"));
  EXPECT_EQ(by_solver.report.choice.method, "constraint_force");
  EXPECT_EQ(by_solver.report.choice.solver, "conjugate_gradient");
  EXPECT_GT(by_solver.report.iterations, 0);
}

TEST(Evaluator, ReasonsAreGivenWithTheForces) {
  const Model m = arm(), chain = arm(100);
  EXPECT_EQ(Evaluated(m, 1, asking_for("auto")).report.choice.reason, "");
  EXPECT_EQ(Evaluated(m, 1, asking_for("articulated_body"), true).report.choice.reason,
            "as asked for");
  EXPECT_EQ(Evaluated(chain, 1, asking_for("auto"), true).report.choice.reason,
            choose_dynamics(chain, {}).reason);
  EXPECT_NE(Evaluated(chain, 2, asking_for("auto"), true).report.choice.reason,
            choose_dynamics(chain, {}).reason);
}

// Every method that takes the machine, on one state and on more than fill the lanes, with and
// without all that there is to tell.
TEST(Evaluator, AllWaysGiveOneMotion) {
  const Model m = arm();
  for (const size_t count : {size_t{1}, size_t{native_lanes + 3}}) {
    const Evaluated want(m, count, asking_for("composite_rigid_body"));
    for (const DynamicsEntry& entry : dynamics_table()) {
      if (!takes(entry, m)) continue;
      for (const bool full : {false, true}) {
        const Evaluated got(m, count, asking_for(std::string(entry.name)), full);
        EXPECT_TRUE(got.report.ok()) << entry.name;
        expect_close(got.du, want.du, 1e-9, std::string(entry.name) + " accelerations");
        expect_close(got.loads, want.loads, 1e-9, std::string(entry.name) + " loads");
        EXPECT_EQ(got.force.empty(), !full || !entry.uses_solver);
      }
    }
  }
}

TEST(Evaluator, ThreadsChangeNoBit) {
  const Model m = arm(40);
  DynamicsOptions options = asking_for("auto");
  const Evaluated one(m, 100, options);
  options.executor = Executor(3);
  const Evaluated three(m, 100, options);
  EXPECT_EQ(one.du, three.du);
  EXPECT_EQ(one.loads, three.loads);
}

// Also on the machines that keep a method from call to call, whatever was asked for before.
TEST(Evaluator, OptionsReachTheMethodThatAutoStandsFor) {
  const Model chain = arm(100);
  const DynamicsCase c(chain, 1);
  std::vector<double> du(chain.nv());
  const BatchInput in{c.state.q.data(), c.state.v.data(), c.tau.data()};
  const Evaluator evaluator(chain);
  const auto error = [&](const DynamicsOptions& options) {
    return evaluator.forward_dynamics(1, in, options, {du.data()}, go_on).error_estimate;
  };
  DynamicsOptions estimated = asking_for("auto");
  estimated.solver_options.set("estimate_error", true);
  EXPECT_EQ(error(asking_for("auto")), 0);
  EXPECT_GT(error(estimated), 0);
  EXPECT_EQ(error(asking_for("auto")), 0);
  for (const size_t count : {size_t{1}, size_t{2}}) {
    DynamicsOptions unknown = asking_for("auto");
    unknown.initial_guess = "magic";
    EXPECT_THROW(Evaluated(chain, count, unknown), InputError);
    EXPECT_THROW(Evaluated(arm(), count, unknown), InputError);
  }
}

// One state after the other, every state is asked about; on lanes, every part.
TEST(Evaluator, OptionsThatChangeNothingKeepTheLanes) {
  const Model m = arm();
  const size_t count = 4;
  const DynamicsOptions usual = asking_for("constraint_force", "thomas");
  const Evaluated states(m, count, usual);
  std::vector<double> du(count * m.nv());
  const BatchInput in{states.q.data(), states.v.data(), states.tau.data()};
  const auto times_asked = [&](const DynamicsOptions& options) {
    int asked = 0;
    Evaluator(m).forward_dynamics(count, in, options, {du.data()}, [&] { return ++asked > 0; });
    return asked;
  };
  DynamicsOptions given = usual;
  given.solver_options.set("omega", 1.0);
  given.solver_options.set("refinement_steps", 0);
  EXPECT_EQ(times_asked(given), times_asked(usual));
  EXPECT_EQ(Evaluated(m, count, given).du, states.du);
  given.solver_options.set("refinement_steps", 1);
  EXPECT_EQ(times_asked(given), static_cast<int>(count));
}

TEST(Evaluator, OneStateIsTheWorkOfTheMethodInTheTable) {
  for (const int n : {1, 5, 100}) {
    const Model m = arm(n);
    const DynamicsCase c(m, 1);
    const Motion6 want = evaluate(*make_dynamics(m, evaluation_options()), m, c.input());
    std::vector<double> du(m.nv());
    BatchInput in{c.state.q.data(), c.state.v.data(), c.tau.data()};
    in.external = c.external.data();
    Evaluator(m).forward_dynamics(1, in, evaluation_options(), {du.data()}, go_on);
    EXPECT_EQ(du, want.du) << n;
  }
}

TEST(Evaluator, PassiveForcesActWhereAskedFor) {
  Draws draws(32);
  ModelSpec spec = tree_spec(std::vector(3, revolute), chain_parents(3), draws);
  const Model plain(spec);
  for (JointSpec& joint : spec.joints) joint.dof = {{DofProperty::damping, {0.7}}};
  const Model damped(spec);
  for (const size_t count : {size_t{1}, size_t{4}}) {
    const Evaluated without(plain, count, asking_for("auto"));
    EXPECT_EQ(Evaluated(damped, count, asking_for("auto")).du, without.du);
    const Evaluated with(damped, count, asking_for("auto"), false, true);
    // The same accelerations take the torques and what the damper takes away.
    std::vector<double> tau(with.tau.size());
    BatchInput in{with.q.data(), with.v.data(), nullptr, with.du.data()};
    Evaluator(damped).inverse_dynamics(count, in, {}, Executor(1), {.tau = tau.data()}, go_on);
    for (size_t i = 0; i < tau.size(); ++i)
      EXPECT_NEAR(tau[i], with.tau[i] - 0.7 * with.v[i], 1e-9);
  }
}

TEST(Evaluator, LoadsByCauseAddUp) {
  const Model m = arm();
  const size_t count = 3;
  const Evaluated all(m, count, asking_for("auto"));
  const std::vector<std::string> names = {"gravity", "velocity", "drive"};
  const std::vector<Cause> causes = causes_from_names(names);
  std::vector<double> parts(causes.size() * all.loads.size());
  BatchInput in{all.q.data(), all.v.data(), all.tau.data()};
  const Evaluator evaluator(m);
  for (const char* method : {"articulated_body", "constraint_force"}) {
    ASSERT_TRUE(
        evaluator.loads_by_cause(count, in, causes, method, Executor(1), parts.data(), go_on).ok());
    const size_t n = 6 * m.n_joints();
    std::vector<double> sum(all.loads.size());
    for (size_t i = 0; i < count; ++i)
      for (size_t c = 0; c < causes.size(); ++c)
        for (size_t k = 0; k < n; ++k) sum[i * n + k] += parts[(i * causes.size() + c) * n + k];
    expect_close(sum, all.loads, 1e-9, method);
  }
  EXPECT_THROW(
      evaluator.loads_by_cause(count, in, causes, "piecewise", Executor(1), parts.data(), go_on),
      InputError);
  const std::vector<std::string> unknown = {"wind"};
  EXPECT_THROW(causes_from_names(unknown), InputError);
}

TEST(Evaluator, FailuresNameTheMethodTheBodyAndTheRemedy) {
  const Model m(singular_spec());
  for (const size_t count : {size_t{1}, size_t{2}})  // known before any elimination
    EXPECT_THROW(Evaluated(m, count, asking_for("auto")), InputError);
  DynamicsReport report;
  report.outcome = Outcome::not_positive_definite;
  report.body = 0;
  const std::string text =
      failure_text(m, evaluation_report(m, {"articulated_body", "", ""}, report));
  for (const std::string& part :
       {std::string("method articulated_body"), "'" + m.body_name(0) + "'",
        std::string(remedy(Outcome::not_positive_definite))})
    EXPECT_NE(text.find(part), std::string::npos) << text;
}

TEST(Evaluator, RefusesWhatTheModelHasNot) {
  Draws draws(33);
  ModelSpec spec = tree_spec(std::vector(2, revolute), chain_parents(2), draws);
  make_massless(spec.links[1]);
  const Model m(spec);
  const DynamicsCase c(m, 1);
  std::vector<double> du(m.nv()), wrench(6 * m.n_joints(), 1.0);
  BatchInput in{c.state.q.data(), c.state.v.data(), c.tau.data()};
  const Evaluator evaluator(m);
  const auto forward = [&] {
    evaluator.forward_dynamics(1, in, asking_for("auto"), {du.data()}, go_on);
  };
  EXPECT_NO_THROW(forward());
  in.external = wrench.data();
  EXPECT_THROW(forward(), InputError);
  in.external = nullptr;
  in.prescribed = du.data();
  EXPECT_THROW(forward(), InputError);
  in.prescribed = nullptr;
  in.gravity_factor = NAN;
  EXPECT_THROW(forward(), InputError);
}

TEST(Evaluator, StopsBetweenPartsWhenItIsAskedTo) {
  const Model m = arm();
  const DynamicsCase c(m, 1);
  std::vector<double> q, v, du(4 * m.nv(), -7);
  for (int i = 0; i < 4; ++i) {
    q.insert(q.end(), c.state.q.begin(), c.state.q.end());
    v.insert(v.end(), c.state.v.begin(), c.state.v.end());
  }
  const BatchInput in{q.data(), v.data()};
  int asked = 0;
  Evaluator(m).forward_dynamics(4, in, asking_for("composite_rigid_body"), {du.data()},
                                [&] { return ++asked < 3; });
  EXPECT_NE(du[m.nv()], -7);
  EXPECT_EQ(du[2 * m.nv()], -7);
}

// States of machines with loops are dealt out over threads, and a wrong one is told by its number.
TEST(Evaluator, ThreadsShareStatesWithLoops) {
  const Model m{row_of_four_bars(2)};
  constexpr size_t count = 400;
  std::vector<double> q(count * m.nq()), v(count * m.nv());
  std::vector<double> du(count * m.nv()), loads(count * 6 * m.n_loads());
  const BatchInput in{q.data(), v.data()};
  DynamicsOptions options = asking_for("auto");
  const auto evaluate = [&](int threads) {
    options.executor = Executor(threads);
    return Evaluator(m).forward_dynamics(count, in, options, {du.data(), loads.data()}, go_on);
  };
  const EvaluationReport report = evaluate(1);
  EXPECT_TRUE(report.ok());
  EXPECT_EQ(report.choice.method, "articulated_body");
  const std::vector<double> first = du, first_loads = loads;
  EXPECT_NE(first[0], 0);
  du.assign(du.size(), NAN);
  EXPECT_TRUE(evaluate(3).ok());
  EXPECT_EQ(du, first);
  EXPECT_EQ(loads, first_loads);
  q[123 * m.nq()] = q[321 * m.nq()] = 0.1;
  try {
    evaluate(3);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()).find("state 123: "), 0u) << error.what();
  }
}

}  // namespace
}  // namespace linkwise::testing
