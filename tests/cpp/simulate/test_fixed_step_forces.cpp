// What fixed steps do not resolve of forces is told, and nothing else.
#include <gtest/gtest.h>

#include "linkwise/simulate/batch_simulation.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

/// A slider of 1 kg in front of a stop at 1 m.
std::shared_ptr<const Model> slider(double stiffness, double damping = 0) {
  ModelSpec spec = pendulum();
  spec.gravity = {};
  spec.joints[0].type = prismatic;
  spec.joints[0].dof = {{DofProperty::upper, {1}},
                        {DofProperty::limit_stiffness, {stiffness}},
                        {DofProperty::limit_damping, {damping}}};
  return make_model(spec);
}

std::string told(std::shared_ptr<const Model> model, double step, double speed,
                 std::string_view kind = "runge_kutta_4") {
  Simulation simulation(std::move(model), fixed_step(step, kind));
  const double q = 0.123, v = speed;
  simulation.start(0, {&q, &v});
  run(simulation, every(0.5, 1.5));
  return simulation.force_doubt();
}

TEST(FixedStepForces, AStopIsToldWhereStepsAreLongerThanItsTime) {
  for (std::string_view kind : {"runge_kutta_4", "semi_implicit_euler"}) {
    SCOPED_TRACE(kind);
    EXPECT_EQ(told(slider(400), 1e-3, 2, kind), "");
    EXPECT_NE(told(slider(4e6), 1e-3, 2, kind), "");
    EXPECT_EQ(told(slider(4e6), 2e-5, 2, kind), "");
    // It does not come that far.
    EXPECT_EQ(told(slider(4e6), 1e-3, 0.1, kind), "");
  }
}

TEST(FixedStepForces, AStopThatIsPassedThroughWithinAStepIsTold) {
  // In and out again between two ends of steps; stages are free, or throw the slider back.
  for (double stiffness : {1e7, 1e8, 1e9, 1e10})
    for (double speed : {0.9, 1.1, 1.3, 1.7}) {
      SCOPED_TRACE(stiffness);
      EXPECT_NE(told(slider(stiffness), 1e-2, speed), "");
    }
}

TEST(FixedStepForces, OfMembersTheWorstIsNamed) {
  const auto model = slider(4e6);
  const size_t n = 5;
  const std::vector<double> q(n, 0.0), v = {0.1, 0.2, 2, 0.3, 4}, times = {1};
  Simulation one(model, with(fixed_step(1e-3), {"articulated_body"}));
  const Simulation* all[] = {&one};
  std::vector<double> position(n);
  Sample samples;
  samples["position"] = position.data();
  MemberNotes notes;
  simulate_batch(
      all, {q.data(), v.data(), nullptr, n}, times, samples, Executor(2), [] { return true; },
      nullptr, &notes);
  const ForcesOfMembers& doubt = notes.forces;
  EXPECT_EQ(doubt.members, 2u);
  EXPECT_TRUE(doubt.worst == 2 || doubt.worst == 4);
  EXPECT_NE(doubt.text, "");
}

}  // namespace
}  // namespace linkwise::testing
