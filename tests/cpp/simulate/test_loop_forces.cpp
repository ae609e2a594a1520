// Drives and given motions of joints that close loops: a wheel whose axle has a second bearing, so
// that the loop joint's angle is the wheel's.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/simulate/loop_forces.hpp"

namespace linkwise::testing {
namespace {

std::shared_ptr<const Model> wheel(double damping = 0) {
  ModelSpec spec;
  spec.links.push_back({"base", 0, {}, {}});
  spec.links.push_back({"wheel", 1, {}, {{1, 0, 1, 0, 0, 2}}});
  JointSpec joint;
  joint.parent = "base";
  joint.child = "wheel";
  joint.axes = {{AxisKind::revolute, {0, 0, 1}, 0}};
  joint.name = "axle";
  spec.joints.push_back(joint);
  joint.name = "bearing";
  joint.dof.push_back({DofProperty::damping, {damping}});
  LoopJointSpec loop;
  loop.joint = joint;
  spec.loop_joints.push_back(loop);
  return std::make_shared<const Model>(spec);
}

TEST(LoopForces, TurnsAreCountedFromTheLastAcceptedState) {
  linkwise::Setup setup(wheel(0.5), {});
  setup.settle();
  LoopForces forces(setup);
  double q = 0;
  const double v = 3;
  forces.hold(&q);
  for (; q < 20; q += 1) {
    forces.evaluate(0, &q, &v);
    EXPECT_NEAR(forces.q()[0], q, 1e-12);
    EXPECT_NEAR(forces.tau()[0], -0.5 * v, 1e-12);
    EXPECT_NEAR(forces.dissipated(), 0.5 * v * v, 1e-12);
    EXPECT_EQ(forces.drive()[0], 0);
    forces.accepted(0, &q, &v);
  }
}

TEST(LoopForces, DrivesSeeTheJointsOwnCoordinates) {
  linkwise::Setup setup(wheel(), {});
  Drive drive;
  drive.kind = DriveKind::pd;
  drive.kp = 2;
  drive.kd = 0.5;
  drive.value = {1};
  setup.set_drive(setup.model->load_index("bearing"), drive);
  setup.settle();
  LoopForces forces(setup);
  const double q = 0.3, v = -2;
  forces.evaluate(0, &q, &v);
  EXPECT_NEAR(forces.drive()[0], 2 * (1 - q) - 0.5 * v, 1e-12);
}

TEST(LoopForces, GivenMotionsAreWhatTheInputSays) {
  linkwise::Setup setup(wheel(), {});
  Drive drive;
  drive.kind = DriveKind::motion;
  drive.motion = [](double t, double* q, double* v, double* a) {
    *q = t * t;
    *v = 2 * t;
    *a = 2;
  };
  setup.set_drive(setup.model->load_index("bearing"), drive);
  setup.settle();
  LoopForces forces(setup);
  forces.give(3);
  SweepInput<double> in;
  forces.give_to(in);
  EXPECT_EQ(in.loop_q[0], 9);
  EXPECT_EQ(in.loop_v[0], 6);
  EXPECT_EQ(in.loop_du[0], 2);
  EXPECT_TRUE(setup.driven().loops.elements[0].prescribed);
}

TEST(LoopForces, JointsWithoutCoordinatesTakeNoDrive) {
  ModelSpec spec = wheel()->spec();
  spec.loop_joints[0].joint.type = JointType::fixed;
  spec.loop_joints[0].joint.axes.clear();
  spec.loop_joints[0].joint.dof.clear();
  linkwise::Setup setup(std::make_shared<const Model>(spec), {});
  Drive drive;
  drive.kind = DriveKind::locked;
  EXPECT_THROW(setup.set_drive(setup.model->load_index("bearing"), drive), InputError);
}

}  // namespace
}  // namespace linkwise::testing
