// Locked joints, given motions and wrenches: what a run is given from outside.
#include <gtest/gtest.h>

#include "kinematics/world_twin.hpp"
#include "linkwise/base/error.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

/// The machine with joint 1 replaced by a fixed joint at its position q.
ModelSpec welded_at(const ModelSpec& spec, const Model& model, const std::vector<double>& q) {
  const auto motions = WorldTwin(model).motions(q, std::vector<double>(model.nv()));
  const Pose<double>&parent = motions.pose[model.link_index(spec.joints[1].parent)],
        &child = motions.pose[model.link_index(spec.joints[1].child)];
  ModelSpec out = spec;
  out.keep_fixed = true;
  out.joints[1].type = fixed;
  out.joints[1].rotation = transpose(parent.R) * child.R;
  out.joints[1].translation = transpose_times(parent.R, child.p - parent.p);
  out.joints[1].dof.clear();
  return out;
}

TEST(Locked, EqualsTheMachineWithoutTheJoint) {
  for (JointType type : {revolute, universal, spherical, planar, composite}) {
    Draws draws(105);
    const ModelSpec plain = tree_spec({revolute, type, revolute, prismatic}, {-1, 0, 1, 0}, draws);
    for (const Formulation& f : formulations(Model(plain))) {
      SCOPED_TRACE(std::string(joint_type_name(type)) + " " + ::testing::PrintToString(f));
      ModelSpec spec = plain;
      // What the joint does by itself must not show, but in the torque that holds it.
      if (type != spherical) spec.joints[1].dof = {{DofProperty::stiffness, {50}}};
      spec.joints[1].dof.push_back({DofProperty::armature, {0.4}});
      const auto model = make_model(spec);
      MachineState state = random_state(*model, draws);
      const JointInfo& locked = model->joints[1];
      for (int i = 0; i < locked.nv; ++i) state.v[locked.v + i] = 0;
      const SimulationOptions options = with(fixed_step(1e-3), f);
      Simulation simulation(model, options);
      Drive lock;
      lock.kind = DriveKind::locked;
      simulation.set_drive(1, lock);
      simulation.start(0, {state.q.data(), state.v.data()});

      const auto welded = make_model(welded_at(spec, *model, state.q));
      const auto without = [](std::vector<double> x, int from, int count) {
        x.erase(x.begin() + from, x.begin() + from + count);
        return x;
      };
      Simulation reference(welded, options);
      const auto q0 = without(state.q, locked.q, locked.nq);
      const auto v0 = without(state.v, locked.v, locked.nv);
      reference.start(0, {q0.data(), v0.data()});

      const auto got = run(simulation, every(0.1, 0.5)), want = run(reference, every(0.1, 0.5));
      ASSERT_EQ(got.size(), 6u);
      ASSERT_EQ(want.size(), 6u);
      for (int k = 0; k < 6; ++k) {
        EXPECT_LT(distance(without(got[k].q, locked.q, locked.nq), want[k].q), 1e-10);
        EXPECT_LT(distance(without(got[k].du, locked.v, locked.nv), want[k].du), 1e-8);
        EXPECT_LT(distance(got[k].loads, want[k].loads), 1e-8);
        const auto held = WorldTwin(*model).inverse_dynamics(got[k].q, got[k].v, got[k].du);
        for (int i = 0; i < locked.nv; ++i) {
          EXPECT_EQ(got[k].v[locked.v + i], 0);
          EXPECT_EQ(got[k].du[locked.v + i], 0);
          if (type == spherical || type == planar) continue;
          const double spring = -50 * got[k].q[locked.q + i];
          EXPECT_NEAR(got[k].drive_torque[locked.v + i], held.tau[locked.v + i] - spring, 1e-8);
        }
      }
    }
  }
}

// ---- Given motions ----------------------------------------------------------------------------

/// A sum of sines, other ones for every coordinate, and its derivatives.
void sines(double t, int n, double* q, double* v, double* a) {
  for (int i = 0; i < n; ++i) {
    const double w = 3 + i, phase = 0.4 * i;
    q[i] = 0.7 * std::sin(w * t + phase);
    v[i] = 0.7 * w * std::cos(w * t + phase);
    a[i] = -0.7 * w * w * std::sin(w * t + phase);
  }
}

// The joint is where it should be, its torque is that of inverse dynamics less its own spring, and
// the joints beside it move as no torque at all makes them.
TEST(GivenMotion, IsFollowedExactly) {
  for (JointType type : {revolute, prismatic, universal, planar, composite}) {
    Draws draws(131);
    ModelSpec spec = tree_spec({revolute, type, revolute, prismatic}, {-1, 0, 1, 0}, draws);
    spec.joints[1].dof = {{DofProperty::damping, {2}}, {DofProperty::armature, {0.4}}};
    const auto model = make_model(spec);
    const WorldTwin twin(*model);
    const JointInfo& moved = model->joints[1];
    Drive motion;
    motion.kind = DriveKind::motion;
    motion.motion = [n = moved.nv](double t, double* q, double* v, double* a) {
      sines(t, n, q, v, a);
    };
    const MachineState state = random_state(*model, draws);
    for (const Formulation& f : formulations(*model)) {
      if (f.state) continue;
      SCOPED_TRACE(std::string(joint_type_name(type)) + " " + ::testing::PrintToString(f));
      Simulation simulation(model, with(fixed_step(1e-3), f));
      simulation.set_drive(1, motion);
      simulation.start(0, {state.q.data(), state.v.data()});
      for (double t : {0.0, 0.1, 0.2537}) {
        Recorded at;
        ASSERT_TRUE(advance(simulation, t, at));
        const auto rate = twin.position_rate(at.q, at.v);
        double q[6], v[6], a[6];
        sines(t, moved.nv, q, v, a);
        for (int i = 0; i < moved.nv; ++i) {
          EXPECT_DOUBLE_EQ(at.q[moved.q + i], q[i]);
          EXPECT_NEAR(rate[moved.q + i], v[i], 1e-13);
        }
        const auto want = twin.inverse_dynamics(at.q, at.v, at.du);
        EXPECT_LT(distance(at.loads, want.loads), 1e-9);
        for (int i = 0; i < model->nv(); ++i) {
          const bool given = i >= moved.v && i < moved.v + moved.nv;
          EXPECT_NEAR(want.tau[i], given ? at.drive_torque[i] - 2 * at.v[i] : 0, 1e-9);
        }
      }
    }
  }
}

TEST(GivenMotion, IsRefusedWhereItCannotBe) {
  const auto model = make_model(every_kind());
  Drive motion;
  motion.kind = DriveKind::motion;
  motion.motion = [](double, double* q, double* v, double* a) { *q = *v = *a = 0; };
  Simulation simulation(model, fixed_step(1e-3));
  EXPECT_THROW(simulation.set_drive(1, motion), InputError);  // a quaternion
  Simulation bodies(model,
                    with(fixed_step(1e-3), {"constraint_force", find_state("body_velocities")}));
  bodies.set_drive(0, motion);
  const std::vector<double> q = model->neutral_configuration(), v(model->nv());
  EXPECT_THROW(bodies.start(0, {q.data(), v.data()}), InputError);
}

/// A ball of 2 kg spinning about z at 3 rad/s, pushed with 4 N along x.
std::vector<Recorded> push(bool world) {
  ModelSpec spec;
  spec.gravity = {};
  spec.floating_base = true;
  spec.links = {{"ball", 2, {}, {{0.1, 0, 0.1, 0, 0, 0.1}}}};
  Simulation simulation(make_model(spec), fixed_step(1e-3));
  Wrench wrench;
  wrench.world = world;
  wrench.value = {4, 0, 0, 0, 0, 0};
  simulation.add_wrench(wrench);
  const std::vector<double> q{0, 0, 0, 0, 0, 0, 1}, v{0, 0, 0, 0, 0, 3};
  simulation.start(0, {q.data(), v.data()});
  return run(simulation, {0.7});
}

TEST(Wrenches, InTheWorldKeepTheirDirection) {
  const auto at = push(true);
  ASSERT_EQ(at.size(), 1u);
  EXPECT_NEAR(at[0].q[0], 0.5 * 2 * 0.7 * 0.7, 1e-10);
  EXPECT_NEAR(at[0].q[1], 0, 1e-10);
}

TEST(Wrenches, InTheBodyTurnWithIt) {
  // x'' = 2 cos 3t, y'' = 2 sin 3t
  const auto at = push(false);
  ASSERT_EQ(at.size(), 1u);
  EXPECT_NEAR(at[0].q[0], 2 * (1 - std::cos(3 * 0.7)) / 9, 1e-10);
  EXPECT_NEAR(at[0].q[1], 2 * (3 * 0.7 - std::sin(3 * 0.7)) / 9, 1e-10);
}

TEST(Wrenches, AppearInTheJointLoads) {
  Draws draws(106);
  const auto model = make_model(every_kind());
  const MachineState state = random_state(*model, draws);
  Simulation simulation(model, fixed_step(1e-3));
  Wrench in_body, in_world;
  in_body.joint = 3;
  in_body.world = false;
  in_body.value = random_values(6, draws);
  in_world.joint = 1;
  in_world.value = random_values(6, draws);
  simulation.add_wrench(in_body);
  simulation.add_wrench(in_world);
  simulation.start(0, {state.q.data(), state.v.data()});
  const auto at = run(simulation, {0, 0.1});
  ASSERT_EQ(at.size(), 2u);
  const WorldTwin twin(*model);
  for (const Recorded& i : at) {
    const auto pose = twin.motions(i.q, i.v).pose[model->joints[1].link];
    std::vector<double> external(6 * model->n_joints());
    for (int k = 0; k < 6; ++k) external[18 + k] = in_body.value[k];
    const auto& w = in_world.value;
    const Vec3<double> f = transpose_times(pose.R, Vec3<double>{w[0], w[1], w[2]});
    const Vec3<double> m = transpose_times(pose.R, Vec3<double>{w[3], w[4], w[5]});
    const double turned[6] = {f.x, f.y, f.z, m.x, m.y, m.z};
    for (int k = 0; k < 6; ++k) external[6 + k] = turned[k];
    const auto want = twin.inverse_dynamics(i.q, i.v, i.du, external);
    EXPECT_LT(distance(i.loads, want.loads), 1e-9);
    EXPECT_LT(distance(want.tau, std::vector<double>(model->nv())), 1e-9);
  }
}

}  // namespace
}  // namespace linkwise::testing
