// Drives and given motions of joints that close loops: a wheel whose axle has a second bearing, so
// that the loop joint's angle is the wheel's. And how well forces of large gain are known there, as
// in the same machine with another joint cut.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/simulate/loop_forces.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

std::shared_ptr<const Model> wheel(double damping = 0) {
  return std::make_shared<const Model>(wheel_on_two_bearings(damping));
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

/// A four-bar in the x-z plane whose crank stands on a load cell: a slide with a spring and a
/// damper. Either the slide closes the loop or the pivot of the rocker does. It starts where the
/// spring has no force.
struct Cell {
  std::shared_ptr<const Model> model;
  std::vector<double> q;
  int load;  ///< row of the slide

  /// crank: direction of the crank at the start.
  Cell(bool closes, std::vector<std::pair<DofProperty, double>> properties, double crank = -0.7) {
    ModelSpec spec;
    spec.gravity = {0, 0, -9.81};
    spec.links.push_back({"ground", 0, {}, {}});
    spec.links.push_back({"cell", 1, {}, {{0.01, 0, 0.01, 0, 0, 0.01}}});
    const auto bar = [&](const char* name, double length, double mass) {
      const double I = mass * length * length / 12;
      spec.links.push_back({name, mass, {length / 2, 0, 0}, {{I, 0, I, 0, 0, I}}});
    };
    bar("crank", 0.3, 1);
    bar("coupler", 1, 2);
    bar("rocker", 0.8, 2);
    const auto joint = [](const char* name, const char* parent, const char* child, double at) {
      JointSpec out;
      out.name = name;
      out.parent = parent;
      out.child = child;
      out.translation = {at, 0, 0};
      out.axes = {{AxisKind::revolute, {0, 1, 0}, 0}};
      return out;
    };
    JointSpec cell = joint("cell", "ground", "cell", 0);
    cell.type = JointType::prismatic;
    cell.axes = {{AxisKind::prismatic, {0, 0, 1}, 0}};
    for (const auto& [property, value] : properties) cell.dof.push_back({property, {value}});
    // Directions of the coupler away from the crank, and of the rocker towards its pivot.
    const double x = 1 - 0.3 * std::cos(crank), z = 0.3 * std::sin(crank), r = std::hypot(x, z),
                 to_pivot = std::atan2(-z, x),
                 coupler = to_pivot - std::acos((1 + r * r - 0.64) / (2 * r)),
                 rocker = to_pivot + std::acos((0.64 + r * r - 1) / (1.6 * r)),
                 pi = std::numbers::pi;
    LoopJointSpec loop;
    if (closes) {
      spec.joints = {joint("D", "ground", "rocker", 1), joint("C", "rocker", "coupler", 0.8),
                     joint("B", "coupler", "crank", 1), joint("A", "crank", "cell", 0.3)};
      loop.joint = cell;
      q = {rocker + pi, coupler - rocker, crank - coupler, -crank - pi};
    } else {
      spec.joints = {cell, joint("A", "cell", "crank", 0), joint("B", "crank", "coupler", 0.3),
                     joint("C", "coupler", "rocker", 1)};
      loop.joint = joint("D", "ground", "rocker", 1);
      loop.child_translation = {0.8, 0, 0};
      q = {0, crank, coupler - crank, rocker - coupler};
    }
    spec.loop_joints.push_back(loop);
    model = make_model(spec);
    load = model->load_index("cell");
  }

  /// Force along the slide at some times, and what is said about it.
  std::vector<double> forces(double tolerance, std::string* doubt = nullptr,
                             std::string_view kind = "auto", double step = 0) const {
    SimulationOptions options = fixed_step(step, kind);
    if (tolerance > 0) options.integration.tolerance = tolerance;
    options.exact_start = true;
    Simulation simulation(model, options);
    const std::vector<double> v(model->nv());
    simulation.start(0, {q.data(), v.data()});
    std::vector<double> out, loads(6 * static_cast<size_t>(model->n_loads()));
    Sample sample;
    sample["joint_load"] = loads.data();
    for (const double t : {0.01, 0.03, 0.1, 0.2, 0.25}) {
      EXPECT_TRUE(simulation.advance(t, sample));
      out.push_back(loads[6 * load + 2]);
    }
    if (doubt) *doubt = simulation.force_doubt();
    return out;
  }
};

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double out = 0;
  for (size_t i = 0; i < a.size(); ++i) out = std::max(out, std::abs(a[i] - b[i]));
  return out;
}

/// Of three starts that differ by some milliradians, because the largest error of a run with coarse
/// steps is a matter of chance.
double middle_error(bool closes, const std::vector<std::pair<DofProperty, double>>& properties,
                    double tolerance) {
  std::vector<double> errors;
  for (const double crank : {-0.7, -0.697, -0.694}) {
    const std::vector<double> truth = Cell(false, properties, crank).forces(1e-11);
    double largest = 0;
    for (const double force : truth) largest = std::max(largest, std::abs(force));
    EXPECT_GT(largest, 10);
    std::string doubt;
    const Cell cell(closes, properties, crank);
    errors.push_back(largest_difference(cell.forces(tolerance, &doubt), truth) / largest);
    EXPECT_EQ(doubt, "");
  }
  std::ranges::sort(errors);
  return errors[1];
}

TEST(LoopForces, AStiffSpringIsAsWellKnownAsInTheTree) {
  const std::vector<std::pair<DofProperty, double>> stiff = {{DofProperty::stiffness, 1e8},
                                                             {DofProperty::damping, 1e4}};
  for (const double tolerance : {1e-4, 1e-6, 1e-8}) {
    SCOPED_TRACE(tolerance);
    for (const bool closes : {false, true})
      EXPECT_LT(middle_error(closes, stiff, tolerance), 1e-2) << closes;
  }
}

TEST(LoopForces, ABlowIsAsWellKnownAsInTheTree) {
  // It falls onto a stop at 0 and stays there, damped.
  const std::vector<std::pair<DofProperty, double>> stop = {{DofProperty::lower, 0},
                                                            {DofProperty::upper, 1},
                                                            {DofProperty::limit_stiffness, 1e7},
                                                            {DofProperty::damping, 3e3}};
  const Cell tree(false, stop), loop(true, stop);
  const std::vector<double> truth = tree.forces(1e-10);
  EXPECT_LT(largest_difference(loop.forces(1e-6), truth), 0.2);
  EXPECT_LT(largest_difference(loop.forces(1e-8), truth), 0.02);
}

TEST(LoopForces, FixedStepsSayWhatTheyDoNotResolve) {
  const std::vector<std::pair<DofProperty, double>> stiff = {{DofProperty::stiffness, 1e8},
                                                             {DofProperty::damping, 1e4}};
  for (const bool closes : {false, true}) {
    const Cell cell(closes, stiff);
    std::string coarse, fine;
    cell.forces(0, &coarse, "semi_implicit_euler", 1e-4);
    cell.forces(0, &fine, "runge_kutta_4", 1e-5);
    EXPECT_NE(coarse.find("joint 'cell'"), std::string::npos) << coarse;
    EXPECT_EQ(fine, "");
  }
}

TEST(LoopForces, WhatLoopsHoldIsNotWatched) {
  // The rocker may tilt in its pivot, but the other hinges hold the plane.
  for (const bool closes : {false, true}) {
    ModelSpec spec = Cell(closes, {{DofProperty::stiffness, 1e4}}).model->spec();
    JointSpec& pivot = closes ? spec.joints[0] : spec.loop_joints[0].joint;
    pivot.type = JointType::universal;
    pivot.axes.push_back({AxisKind::revolute, {0, 0, 1}, 0});
    pivot.dof = {{DofProperty::stiffness, {0, 1e9}}};
    Cell cell(closes, {{DofProperty::stiffness, 1e4}});
    cell.model = make_model(spec);
    if (closes) cell.q.insert(cell.q.begin() + 1, 0.0);
    std::string doubt;
    cell.forces(1e-6, &doubt);
    EXPECT_EQ(doubt, "");
  }
}

}  // namespace
}  // namespace linkwise::testing
