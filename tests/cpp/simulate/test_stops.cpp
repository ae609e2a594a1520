// Why runs stop or do not start, and what is said about it.
#include <limits>

#include <gtest/gtest.h>

#include "base/error_of.hpp"
#include "linkwise/base/error.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

// A torque or a wrench goes bad at t = 0.25: whatever the method, the integrator and the badness,
// the joint that it came in at is named although it spoils the accelerations of all.
TEST(Stops, NotFiniteNamesTheJointAndKeepsWhatCameBefore) {
  Draws draws(107);
  const int n = 16;
  const auto model = make_model(tree_spec(std::vector(n, revolute), chain_parents(n), draws));
  const auto check = [&](Simulation& simulation, int joint) {
    const std::vector<double> zero(n);
    simulation.start(0, {zero.data(), zero.data()});
    EXPECT_EQ(run(simulation, every(0.1, 1)).size(), 3u);  // 0, 0.1, 0.2
    const Ending& stop = simulation.ending();
    EXPECT_FALSE(stop.ok());
    EXPECT_EQ(stop.outcome, Outcome::not_finite);
    EXPECT_EQ(stop.joint, model->joints[joint].name);
    EXPECT_NEAR(stop.time, 0.25, 0.05);
    EXPECT_FALSE(stop.text.empty());
    Recorded later;
    EXPECT_FALSE(advance(simulation, 2, later));
  };
  for (const IntegratorEntry& integrator : integrator_registry())
    for (const Formulation& f : formulations(*model))
      for (double bad : {std::numeric_limits<double>::quiet_NaN(), infinity}) {
        SCOPED_TRACE(std::string(integrator.name) + " " + ::testing::PrintToString(f));
        const SimulationOptions options = with(fixed_step(1e-3, integrator.name), f);
        Drive drive;
        drive.kind = DriveKind::torque_callable;
        drive.callable = [bad](double t, const double*, const double*, double* out) {
          *out = t > 0.25 ? bad : 0;
        };
        Simulation driven(model, options);
        driven.set_drive(2, drive);
        check(driven, 2);
        Wrench wrench;
        wrench.joint = 1;
        wrench.callable = [bad](double t, double* out) {
          std::fill(out, out + 6, t > 0.25 ? bad : 0);
        };
        Simulation pushed(model, options);
        pushed.add_wrench(wrench);
        check(pushed, 1);
      }
}

TEST(Stops, AStateThatBlowsUpIsNotFinite) {
  const auto model = make_model(pendulum());
  Simulation simulation(model, fixed_step(1e-3));
  Drive drive;
  drive.kind = DriveKind::torque_callable;
  drive.callable = [](double, const double*, const double* v, double* out) {
    *out = 1e3 * v[0] * v[0] * v[0];  // infinite speed within a finite time
  };
  simulation.set_drive(0, drive);
  const double q = 0, v = 1;
  simulation.start(0, {&q, &v});
  const auto at = run(simulation, every(0.01, 10));
  EXPECT_LT(at.size(), 1000u);
  EXPECT_EQ(simulation.ending().outcome, Outcome::not_finite);
  EXPECT_EQ(simulation.ending().joint, simulation.model().joints[0].name);
  for (const Recorded& i : at) EXPECT_TRUE(std::isfinite(i.q[0] + i.v[0]));
}

TEST(Stops, WhenItIsAskedTo) {
  const auto model = make_model(pendulum());
  for (std::string_view kind : all_kinds()) {
    Simulation simulation(model, fixed_step(1e-3, kind));
    int asked = 0;
    simulation.set_interrupt([&] { return ++asked > 20; });
    const double q = 0.5, v = 0;
    simulation.start(0, {&q, &v});
    EXPECT_EQ(run(simulation, {0, 1e-3, 1e9}).size(), 2u);
    EXPECT_EQ(simulation.ending().outcome, Outcome::interrupted);
    EXPECT_GT(simulation.ending().time, 1e-3);
    EXPECT_LT(simulation.ending().time, 1e3);
  }
}

// A failure that the integrator recovered from is over: nothing later is laid to its joint.
TEST(Stops, AfterARecoveryWithoutAJoint) {
  const auto model = make_model(pendulum());
  for (const IntegratorEntry& entry : integrator_registry()) {
    if (entry.fixed_step) continue;
    Simulation simulation(model, fixed_step(1e-3, entry.name));
    bool failed = false;
    Drive drive;
    drive.kind = DriveKind::torque_callable;
    drive.callable = [&](double t, const double*, const double*, double* out) {
      const bool fails = t > 0.25 && !failed;
      failed |= fails;
      *out = fails ? std::numeric_limits<double>::quiet_NaN() : 0;
    };
    simulation.set_drive(0, drive);
    int asked = 0;
    simulation.set_interrupt([&] { return failed && ++asked > 5; });
    const double q = 0.5, v = 0;
    simulation.start(0, {&q, &v});
    run(simulation, {0, 1e9});
    EXPECT_TRUE(failed);
    EXPECT_EQ(simulation.ending().outcome, Outcome::interrupted) << entry.name;
    EXPECT_EQ(simulation.ending().joint, "") << entry.name;
    EXPECT_GT(simulation.ending().time, 0.25);
  }
}

TEST(Stops, AStartThatIsNotFinite) {
  const auto model = make_model(pendulum());
  for (std::string_view kind : all_kinds()) {
    Simulation simulation(model, fixed_step(1e-3, kind));
    const double q = std::numeric_limits<double>::quiet_NaN(), v = 0;
    simulation.start(0, {&q, &v});
    Recorded at;
    EXPECT_FALSE(advance(simulation, 1, at));
    EXPECT_EQ(simulation.ending().outcome, Outcome::not_finite);
  }
}

TEST(Stops, ABodyThatNothingResistsIsNamed) {
  ModelSpec spec = pendulum();
  spec.links[1].com = {};
  Simulation simulation(make_model(spec), fixed_step(1e-3));
  const double zero = 0;
  const std::string said = error_of([&] { simulation.start(0, {&zero, &zero}); });
  EXPECT_NE(said.find("link 'bob' has no mass or no inertia where joint 'hinge'"),
            std::string::npos)
      << said;
}

TEST(Refused, EachWithOneLine) {
  Draws draws(108);
  ModelSpec spec = tree_spec({revolute, revolute, spherical}, chain_parents(3), draws);
  spec.source = "arm.urdf";
  make_massless(spec.links[1]);
  const auto model = make_model(spec);
  Simulation simulation(model, fixed_step(1e-3));
  Drive pd, lock;
  pd.kind = DriveKind::pd;
  pd.value = {0, 0, 0};
  EXPECT_EQ(error_of([&] { simulation.set_drive(2, pd); }),
            "joint 'joint2' of arm.urdf: a pd drive needs angles or distances, not a quaternion; "
            "drive it by torque");
  pd.kp = -1;
  EXPECT_EQ(error_of([&] { simulation.set_drive(0, pd); }),
            "joint 'joint0' of arm.urdf: gains kp and kd must be finite and >= 0");
  Drive motion;
  motion.kind = DriveKind::motion;
  motion.table = linear_table(std::vector<double>{0, 1}, std::vector<double>{0, 1});
  EXPECT_EQ(error_of([&] { simulation.set_drive(0, motion); }),
            "joint 'joint0' of arm.urdf: the velocity of a linear table jumps at every row; use "
            "cubic");
  motion.table.reset();
  motion.course.breakpoints = {2, 1};
  EXPECT_EQ(error_of([&] { simulation.set_drive(0, motion); }),
            "breakpoints are not increasing; sort them");
  EXPECT_EQ(error_of([&] { simulation.add_wrench({}); }),
            "link 'link0' of arm.urdf between two joints has no mass, so no wrench can act on it; "
            "apply it to the next body outboard");
  std::vector<double> q = model->neutral_configuration(), v(5);
  q.back() = 0;
  EXPECT_EQ(error_of([&] {
              simulation.start(0, {q.data(), v.data()});
            }),
            "q[2:6]: the quaternion of joint 'joint2' of arm.urdf has no length; give x, y, z, w "
            "of length "
            "1");
  q.back() = 1;
  lock.kind = DriveKind::locked;
  simulation.set_drive(1, lock);
  v[1] = 0.1;
  EXPECT_EQ(error_of([&] {
              simulation.start(0, {q.data(), v.data()});
            }),
            "joint 'joint1' of arm.urdf is locked but starts with a rate; start it at rest");
  v[1] = 0;
  EXPECT_EQ(error_of([&] { simulation.start(0, {q.data(), v.data()}); }), "no error");
  EXPECT_NE(error_of([&] { Simulation(model, fixed_step(0)); }), "no error");
  SimulationOptions unknown = fixed_step(1e-3);
  unknown.dynamics.method = "magic";
  EXPECT_NE(error_of([&] { Simulation(model, unknown); }), "no error");
}

}  // namespace
}  // namespace linkwise::testing
