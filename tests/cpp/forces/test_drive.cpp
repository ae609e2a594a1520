#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/forces/drive.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;
using Values = std::vector<double>;

Model three_joints() {
  Draws draws(81);
  return Model(tree_spec({revolute, spherical, universal}, chain_parents(3), draws));
}

TEST(Drives, AddTheirTorquesAndNothingElse) {
  const Model model = three_joints();
  const Values q{0.5, 0, 0, 0, 1, -0.3, 0.8}, v{2, 0, 0, 0, 0.1, 0.2};
  const Table ramp{{0, 10}, 1, 1, {3, 1}};  // 1 + 3 t
  Drive torque, table, callable, pd, pd_table, locked;
  torque.kind = DriveKind::torque;
  torque.value = {7};
  table.kind = DriveKind::torque_table;
  table.table = ramp;
  callable.kind = DriveKind::torque_callable;
  callable.callable = [](double t, const double* own_q, const double* own_v, double* out) {
    out[0] = t + own_q[0];
    out[1] = own_q[1] * own_v[1];
  };
  pd.kind = DriveKind::pd;
  pd.value = {0.75};
  pd.kp = 100;
  pd.kd = 10;
  pd_table = pd;
  pd_table.value = {};
  pd_table.table = ramp;
  locked.kind = DriveKind::locked;

  struct Case {
    const char* name;
    int joint;
    Drive drive;
    double t;
    Values want;
  };
  const Case cases[] = {
      {"free", 0, {}, 2, {0, 0, 0, 0, 0, 0}},
      {"locked", 0, locked, 2, {0, 0, 0, 0, 0, 0}},
      {"torque", 0, torque, 2, {7, 0, 0, 0, 0, 0}},
      {"table", 0, table, 2, {7, 0, 0, 0, 0, 0}},
      {"table, beyond its end", 0, table, 20, {31, 0, 0, 0, 0, 0}},
      {"callable", 2, callable, 2, {0, 0, 0, 0, 1.7, 0.16}},
      {"pd", 0, pd, 2, {100 * 0.25 - 10 * 2, 0, 0, 0, 0, 0}},
      {"pd of a table follows its rate", 0, pd_table, 2, {100 * 6.5 + 10, 0, 0, 0, 0, 0}},
      {"pd of a table beyond its end", 0, pd_table, 20, {100 * 30.5 - 20, 0, 0, 0, 0, 0}},
  };
  for (const Case& c : cases) {
    std::vector<Drive> drives(3);
    drives[c.joint] = c.drive;
    Values tau(6, 50);
    add_drive_torques(model, drives, c.t, q.data(), v.data(), tau.data());
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(tau[i], 50 + c.want[i], 1e-12) << c.name << " " << i;
  }
}

// A planar joint slides along axes of its parent, its rates are the child's: the pull towards the
// target must not turn with the child.
TEST(Drives, PlanarPositionControlPullsTowardsItsTarget) {
  Draws draws(82);
  const Model model(tree_spec({planar}, {-1}, draws));
  Drive pd;
  pd.kind = DriveKind::pd;
  pd.value = {1, 0, 0.5};
  pd.kp = 10;
  pd.kd = 2;
  const double quarter = std::numbers::pi / 2;
  const Values q{0, 0, quarter}, v{0.3, 0.4, -1};
  Values tau(3);
  add_drive_torques(model, {pd}, 0, q.data(), v.data(), tau.data());
  // The target lies along the parent's x, which is the child's -y after a quarter turn.
  EXPECT_NEAR(tau[0], -2 * 0.3, 1e-14);
  EXPECT_NEAR(tau[1], -10 - 2 * 0.4, 1e-14);
  EXPECT_NEAR(tau[2], 10 * (0.5 - quarter) + 2, 1e-14);
}

// Rates and accelerations of a given motion, the planar joint's in the child's axes, by sixth-order
// differences of its coordinates and rates; from a function and from a table that goes on.
TEST(GivenMotion, RatesAndAccelerationsBelongToTheCoordinates) {
  Draws draws(84);
  const Table cubic{{0, 1}, 3, 3, random_values(12, draws)};
  Drive table, function;
  table.kind = function.kind = DriveKind::motion;
  table.table = cubic;
  function.motion = [&](double t, double* q, double* v, double* a) {
    cubic.evaluate(t, q, 0, true);
    cubic.evaluate(t, v, 1, true);
    cubic.evaluate(t, a, 2, true);
  };
  const auto slope = [](const auto& f) {
    constexpr double h = 0.01;
    return (45 * (f(h) - f(-h)) - 9 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) / (60 * h);
  };
  for (JointType type : {planar, composite})
    for (const Drive& drive : {table, function}) {
      const Model model(tree_spec({type}, {-1}, draws));
      for (double t : {-0.3, 0.0, 0.6, 1.0, 1.2}) {
        double q[3], v[3], a[3], rate[3], moved[3][3];
        evaluate_motion(model.joints[0], drive, t, q, v, a);
        element_position_rate(model.elements[0], q, v, rate);
        if (type == composite) std::copy(v, v + 3, rate);
        for (int i = 0; i < 3; ++i) {
          EXPECT_NEAR(rate[i], slope([&](double h) {
                        evaluate_motion(model.joints[0], drive, t + h, moved[0], moved[1],
                                        moved[2]);
                        return moved[0][i];
                      }),
                      1e-9);
          EXPECT_NEAR(a[i], slope([&](double h) {
                        evaluate_motion(model.joints[0], drive, t + h, moved[0], moved[1],
                                        moved[2]);
                        return moved[1][i];
                      }),
                      1e-9);
        }
      }
    }
}

TEST(Wrenches, AreTurnedIntoTheirBodiesAndAddUp) {
  const Model model = three_joints();
  Draws draws(83);
  std::vector<double> poses(48);
  std::vector<Mat3<double>> R;
  for (int j = 0; j < 3; ++j) {
    R.push_back(random_rotation(draws));
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) poses[16 * j + 4 * i + k] = R[j].m[3 * i + k];
  }
  const Values a = random_values(6, draws), b = random_values(6, draws);
  Wrench body, world, table, callable;
  body.joint = 1;
  body.world = false;
  body.value = a;
  world.joint = 1;
  world.value = b;
  table.joint = 2;
  table.world = false;
  table.table = Table{{0, 1}, 0, 6, a};
  callable.joint = 0;
  callable.callable = [&](double t, double* out) {
    for (int i = 0; i < 6; ++i) out[i] = t * b[i];
  };
  Values external(18);
  add_wrenches(model, {body, world, table, callable}, 2, poses.data(), external.data());
  const auto turned = [&](int j, const Values& w, int part) {
    const Vec3<double> x =
        transpose_times(R[j], Vec3<double>{w[3 * part], w[3 * part + 1], w[3 * part + 2]});
    return Values{x.x, x.y, x.z};
  };
  for (int part = 0; part < 2; ++part)
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(external[3 * part + i], 2 * turned(0, b, part)[i], 1e-14);
      EXPECT_NEAR(external[6 + 3 * part + i], a[3 * part + i] + turned(1, b, part)[i], 1e-14);
      EXPECT_NEAR(external[12 + 3 * part + i], a[3 * part + i], 1e-14);
    }
}

/// At a point of the world the wrench has its components there, and an arm to the joint's origin.
TEST(Wrenches, AtAPlacedFrameHaveAnArmToTheirJoint) {
  const Model model = three_joints();
  Draws draws(89);
  std::vector<double> poses(48);
  const Mat3<double> R = random_rotation(draws);  // joint frame -> world
  const Vec3<double> origin = random_vector3(draws);
  const double at[3] = {origin.x, origin.y, origin.z};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) poses[16 + 4 * i + k] = R.m[3 * i + k];
    poses[16 + 4 * i + 3] = at[i];
  }
  Wrench wrench;
  wrench.joint = 1;
  wrench.value = random_values(6, draws);
  wrench.placement = {random_rotation(draws), random_vector3(draws)};
  const Vec3<double> point = origin + R * wrench.placement.r;
  const Values& w = wrench.value;
  for (const bool world : {true, false}) {
    wrench.world = world;
    const Mat3<double> own = R * transpose(wrench.placement.R);  // frame -> world
    Vec3<double> f{w[0], w[1], w[2]}, n{w[3], w[4], w[5]};
    if (!world) f = own * f, n = own * n;
    const Vec3<double> force = transpose_times(R, f),
                       moment = transpose_times(R, n + cross(point - origin, f));
    const Values expected{force.x, force.y, force.z, moment.x, moment.y, moment.z};
    Values external(18);
    add_wrenches(model, {wrench}, 0, poses.data(), external.data());
    for (int i = 0; i < 6; ++i) EXPECT_NEAR(external[6 + i], expected[i], 1e-14);
  }
}

}  // namespace
}  // namespace linkwise::testing
