// Accelerations and loads with loops, against equations that share nothing with their elimination:
// the twin's Newton and Euler with the loops' loads as wrenches on an open tree, and the loops'
// relative motion differentiated by a complex step. Together these are all the equations of motion.
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "dynamics/looped_machine.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/indeterminacy.hpp"

namespace linkwise::testing {
namespace {

using Complex = WorldTwin::Complex;

/// Frame on a body by its link: pose, and velocity at the origin, in the world.
template <class T>
struct FrameAt {
  Mat3<T> R;  ///< to world axes
  Vec3<T> p, v, w;
};
FrameAt<Complex> frame_at(const Model& tree, const WorldTwin::Motions<Complex>& m, int body,
                          const Transform<double>& X) {
  for (const JointInfo& j : tree.joints) {
    if (j.body != body || !j.last_of_body) continue;
    const auto& link = m.pose[j.link];
    // Frame in the link's axes. The joint's user frame is the link's.
    const Transform<double> at = X * inverse(j.to_user);
    FrameAt<Complex> out;
    out.R = link.R * transpose(at.R);
    out.p = link.p + link.R * at.r;
    out.w = m.velocity[j.link].w;
    out.v = m.velocity[j.link].s + cross(out.w, out.p);
    return out;
  }
  return {};
}

/// Frames E and F of a loop.
std::pair<FrameAt<Complex>, FrameAt<Complex>> frames_of(const LoopedMachine& machine,
                                                        const LoopJoint& loop,
                                                        const WorldTwin::Motions<Complex>& m) {
  const auto at = [&](int body, const Transform<double>& X) {
    if (body >= 0) return frame_at(machine.tree, m, body, X);
    FrameAt<Complex> out;
    for (int i = 0; i < 9; ++i) out.R.m[i] = transpose(X.R).m[i];
    out.p = Vec3<Complex>{X.r.x, X.r.y, X.r.z};
    return out;
  };
  return {at(loop.parent_body, loop.on_parent), at(loop.joint.body, loop.on_child)};
}

/// v_rel of F against E, in F's axes.
std::vector<Complex> relative_motion(const LoopedMachine& machine, const LoopJoint& loop,
                                     const WorldTwin::Motions<Complex>& m) {
  const auto [E, F] = frames_of(machine, loop, m);
  const Vec3<Complex> lin = transpose_times(F.R, F.v - (E.v + cross(E.w, F.p - E.p)));
  const Vec3<Complex> ang = transpose_times(F.R, F.w - E.w);
  return {lin.x, lin.y, lin.z, ang.x, ang.y, ang.z};
}

/// How fast the ends of a rod part.
Complex parting(const LoopedMachine& machine, const LoopJoint& loop,
                const WorldTwin::Motions<Complex>& m) {
  const auto [E, F] = frames_of(machine, loop, m);
  const Vec3<Complex> r = F.p - E.p;
  return dot(r, F.v - E.v) / std::sqrt(dot(r, r));
}

/// P(q) u of a stack, in F's axes.
Vector6<double> joint_motion(std::span<const Element> stack, const double* q, const double* u) {
  Motion<double> v;
  for (const Element& e : stack) {
    v = element_pose(e, q) * v;
    for (int k = 0; k < e.nv; ++k) {
      const auto column = element_column<double>(e, k);
      v += u[e.v + k] * column;
    }
  }
  return to_array(v);
}

/// The derivative of v_rel, less that of P(q) u with u as it is: P du of a joint.
Vector6<double> speeding(const LoopedMachine& machine, const LoopStates& states, int l,
                         const std::vector<double>& du) {
  const LoopJoint& loop = machine.model.loops.joints[l];
  const auto moving =
      relative_motion(machine, loop, WorldTwin(machine.tree).moved(machine.q, machine.v, du));
  const std::span<const Element> stack = stack_of(machine.model, loop);
  std::vector<double> rate(states.q().size());
  for (const Element& e : stack)
    element_position_rate(e, states.q().data(), states.v().data(), rate.data());
  const auto motion_at = [&](double t) {
    std::vector<double> q = states.q();
    for (int i = loop.joint.q; i < loop.joint.q + loop.joint.nq; ++i) q[i] += t * rate[i];
    return joint_motion(stack, q.data(), states.v().data());
  };
  constexpr double h = 1e-3;
  const auto a1 = motion_at(h), b1 = motion_at(-h), a2 = motion_at(2 * h), b2 = motion_at(-2 * h),
             a3 = motion_at(3 * h), b3 = motion_at(-3 * h);
  Vector6<double> found;
  for (int k = 0; k < 6; ++k) {
    const double turned = (45 * (a1[k] - b1[k]) - 9 * (a2[k] - b2[k]) + (a3[k] - b3[k])) / (60 * h);
    found[k] = moving[k].imag() / WorldTwin::step - turned;
  }
  return found;
}

/// By how much du misses the derivative of v_rel = P u in the directions that the loop holds.
double violation(const LoopedMachine& machine, const LoopStates& states, int l,
                 const std::vector<double>& du) {
  const LoopJoint& loop = machine.model.loops.joints[l];
  if (loop.kind != LoopKind::joint)
    return std::abs(
        parting(machine, loop, WorldTwin(machine.tree).moved(machine.q, machine.v, du)).imag() /
        WorldTwin::step);
  const Vector6<double> moving = speeding(machine, states, l, du);
  Vector6<double> given{};
  if (!machine.du_given.empty())
    given = joint_motion(stack_of(machine.model, loop), states.q().data(), machine.du_given.data());
  double worst = 0;
  for (int i = 0; i < states[l].held; ++i) {
    double sum = 0;
    for (int k = 0; k < 6; ++k) sum += states[l].basis.Q[i][k] * (moving[k] - given[k]);
    worst = std::max(worst, std::abs(sum));
  }
  return worst;
}

/// Torques of a loop's joint less what its rotors take: D du and, where the axes turn at w,
/// w x (D u) of linear and angular rates. add_rotors() made D a number per element.
std::vector<double> beside_rotors(const LoopedMachine& machine, const LoopStates& states, int l,
                                  const std::vector<double>& du, std::vector<double> tau) {
  const Vector6<double> moving = speeding(machine, states, l, du);
  const auto& D = machine.model.loops.dof[static_cast<int>(DofProperty::armature)];
  for (int k = 0; k < states[l].basis.n; ++k)
    tau[states[l].dof[k]] -= D[states[l].dof[k]] * along(states[l].basis.dual[k], moving);
  const double* u = states.v().data();
  for (const Element& e : stack_of(machine.model, machine.model.loops.joints[l])) {
    if (e.kind == ElementKind::planar) {
      tau[e.v] += D[e.v] * u[e.v + 2] * u[e.v + 1];
      tau[e.v + 1] -= D[e.v] * u[e.v + 2] * u[e.v];
    } else if (e.kind == ElementKind::floating) {
      const Vec3<double> bias = D[e.v] * cross(Vec3<double>{u[e.v + 3], u[e.v + 4], u[e.v + 5]},
                                               Vec3<double>{u[e.v], u[e.v + 1], u[e.v + 2]});
      tau[e.v] -= bias.x;
      tau[e.v + 1] -= bias.y;
      tau[e.v + 2] -= bias.z;
    }
  }
  return tau;
}

/// What of the torques wanted is neither given nor that of any coupling.
std::vector<double> beside_couplings(const LoopedMachine& machine, std::vector<double> wanted,
                                     const std::vector<double>& given) {
  const auto& couplings = machine.model.couplings;
  const size_t n = couplings.size();
  std::vector<std::vector<double>> pull(n, std::vector<double>(wanted.size()));
  for (size_t i = 0; i < n; ++i)
    for (const Coupling::Term& term : couplings[i].terms)
      pull[i][term.v] += term.slope(machine.q[term.q]);
  std::vector<double> A(n * n), b(n), s(n);
  for (size_t k = 0; k < wanted.size(); ++k) wanted[k] -= given[k];
  for (size_t i = 0; i < n; ++i)
    for (size_t k = 0; k < wanted.size(); ++k) {
      b[i] += pull[i][k] * wanted[k];
      for (size_t j = 0; j < n; ++j) A[i * n + j] += pull[i][k] * pull[j][k];
    }
  SemidefiniteFactor factor;
  factor.factor(static_cast<int>(n), A.data(), 1e-9);
  factor.solve(b.data(), s.data());
  for (size_t i = 0; i < n; ++i)
    for (size_t k = 0; k < wanted.size(); ++k) wanted[k] -= pull[i][k] * s[i];
  return wanted;
}

/// Evaluates, and compares with the equations of motion.
void expect_motion(const LoopedMachine& machine, std::uint64_t seed, int want_rank) {
  const Model& model = machine.model;
  const DynamicsCase c(machine.tree, seed);
  Draws draws(seed + 1);
  std::vector<double> loop_tau(model.loops.nv);
  for (double& x : loop_tau) x = draws.normal();
  SweepInput<double> in = machine.input();
  in.tau = c.tau.data();
  in.prescribed = c.given.data();
  in.external = c.external.data();
  in.loop_tau = loop_tau.data();
  std::vector<double> du(model.nv()), loads(6 * (model.n_joints() + model.n_loops()));
  ArticulatedLoops kernel(model);
  ASSERT_TRUE(kernel.evaluate(in, du.data(), loads.data()));
  EXPECT_EQ(kernel.report().rank, want_rank);
  EXPECT_LT(kernel.report().contradiction, 1e-9);

  double size = 10;
  for (const double x : du) size = std::max(size, std::abs(x));
  for (int l = 0; l < model.n_loops(); ++l)
    EXPECT_LT(violation(machine, kernel.states(), l, du), 1e-9 * size) << "loop " << l;

  std::vector<double> external = c.external;
  double largest = 1;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& loop = model.loops.joints[l];
    const LoopState& at = kernel.states()[l];
    const Force<double> w = transpose_times(
        loop.joint.to_user, to_force(&loads[6 * (static_cast<size_t>(model.n_joints()) + l)]));
    machine.push(loop.joint.body, wrench_on_b(loop, w), external);
    machine.push(loop.parent_body, wrench_on_a(at, w), external);
    for (const double x : to_array(w)) largest = std::max(largest, std::abs(x));
  }
  const auto want = WorldTwin(machine.tree).inverse_dynamics(machine.q, machine.v, du, external);
  for (const double x : want.loads) largest = std::max(largest, std::abs(x));
  const std::vector<double> missing = beside_couplings(machine, want.tau, c.tau);
  for (const Element& e : machine.tree.elements)
    for (int k = e.v; k < e.v + e.nv; ++k)
      if (!e.prescribed) {
        EXPECT_NEAR(missing[k], 0, 1e-10 * largest) << "dof " << k;
      }
  for (const Coupling& coupling : model.couplings) {
    double sum = 0;
    for (const Coupling::Term& term : coupling.terms) {
      const double x = machine.q[term.q], u = machine.v[term.v];
      sum += term.slope(x) * du[term.v] + term.curvature(x) * u * u;
    }
    EXPECT_NEAR(sum, 0, 1e-10 * size) << coupling.name;
  }
  for (size_t i = 0; i < want.loads.size(); ++i)
    EXPECT_NEAR(loads[i], want.loads[i], 1e-10 * largest) << "load " << i;
  // What a loop joint transmits along its own columns is what drives it, less what rotors take.
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& loop = model.loops.joints[l];
    const std::vector<double> driven =
        loop.kind != LoopKind::joint ? loop_tau
                                     : beside_rotors(machine, kernel.states(), l, du, loop_tau);
    const std::span<const Element> stack = stack_of(model, loop);
    const Vector6<double> w = to_array(transpose_times(
        loop.joint.to_user, to_force(&loads[6 * (static_cast<size_t>(model.n_joints()) + l)])));
    std::vector<double> unit(model.loops.nv);
    for (int k = loop.joint.v; k < loop.joint.v + loop.joint.nv; ++k) {
      unit[k] = 1;
      const double transmitted =
          along(joint_motion(stack, kernel.states().q().data(), unit.data()), w);
      if (!stack[0].prescribed) {
        EXPECT_NEAR(transmitted, driven[k], 1e-9 * largest);
      }
      unit[k] = 0;
    }
  }
  // Loads asked for or not: the same accelerations.
  std::vector<double> again(model.nv());
  ArticulatedLoops other(model);
  ASSERT_TRUE(other.evaluate(in, again.data(), nullptr));
  for (int k = 0; k < model.nv(); ++k) EXPECT_NEAR(again[k], du[k], 1e-11 * size);
}

/// A machine of two branches that a loop joint of some type closes.
LoopedMachine two_branches(JointType type, bool to_ground) {
  Draws draws(to_ground ? 31 : 32);
  LoopedMachine machine(tree_spec({JointType::revolute, JointType::universal, JointType::spherical,
                                   JointType::prismatic, JointType::spherical, JointType::revolute,
                                   JointType::universal, JointType::spherical},
                                  {-1, 0, 1, 2, 1, 4, 5, 6}, draws),
                        draws);
  machine.close(type, to_ground ? -1 : 7, 3, draws);
  return machine;
}

TEST(ArticulatedLoops, EveryJointTypeClosesALoop) {
  for (const JointType type : all_joint_types) {
    if (type == JointType::composite) continue;
    SCOPED_TRACE(joint_type_name(type));
    for (const bool to_ground : {true, false}) {
      LoopedMachine machine = two_branches(type, to_ground);
      const int rank = machine.make_consistent();
      EXPECT_EQ(rank, 6 - machine.model.loops.joints[0].joint.nv);
      expect_motion(machine, 5, rank);
    }
  }
}

TEST(ArticulatedLoops, RotorsOnLoopJoints) {
  for (const JointType type : all_joint_types) {
    if (type == JointType::composite) continue;
    SCOPED_TRACE(joint_type_name(type));
    for (const bool to_ground : {true, false}) {
      Draws draws(77);
      LoopedMachine machine = two_branches(type, to_ground);
      machine.add_rotors(draws);
      const int rank = machine.make_consistent();
      EXPECT_EQ(rank, 6 - machine.model.loops.joints[0].joint.nv);
      expect_motion(machine, 5, rank);
    }
  }
}

TEST(ArticulatedLoops, GivenMotionsOfLoopJoints) {
  for (const JointType type : all_joint_types) {
    if (type == JointType::composite) continue;
    SCOPED_TRACE(joint_type_name(type));
    for (const bool to_ground : {true, false}) {
      Draws draws(78);
      LoopedMachine machine = two_branches(type, to_ground);
      machine.make_consistent();
      machine.prescribe(0, draws);
      expect_motion(machine, 5, 6);
    }
  }
}

TEST(ArticulatedLoops, RodsKeepTwoPointsApart) {
  for (const int a : {-1, 7}) {
    Draws draws(50 + a);
    LoopedMachine machine(
        tree_spec(
            {JointType::revolute, JointType::universal, JointType::spherical, JointType::prismatic,
             JointType::spherical, JointType::revolute, JointType::universal, JointType::spherical},
            {-1, 0, 1, 2, 1, 4, 5, 6}, draws),
        draws);
    for (const int b : {3, 2, 4}) machine.close_rod(a, b, draws);
    EXPECT_EQ(machine.make_consistent(), 3);
    expect_motion(machine, 5, 3);
  }
}

TEST(ArticulatedLoops, CouplingsTieJointsAnywhere) {
  using enum JointType;
  for (int sample = 0; sample < 40; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(900 + sample);
    ModelSpec spec = tree_spec({revolute, prismatic, revolute, spherical, helical, revolute,
                                revolute, prismatic, revolute},
                               random_parents(9, draws), draws);
    if (sample % 4 == 1) make_massless(spec.links[1 + draws.below(3)]);
    if (sample % 5 == 2) spec.joints[5].dof.push_back({DofProperty::armature, {0.7}});
    spec.floating_base = sample % 3 == 0;
    std::optional<LoopedMachine> machine;
    try {
      machine.emplace(spec, draws);
    } catch (const InputError&) {
      continue;  // a massless link at a tip
    }
    if (!machine->tree.undetermined().empty()) continue;
    for (int c = 0; c < 1 + sample % 3; ++c)
      machine->couple(1 + draws.below(4), draws, sample % 2 == 0);
    const int bodies = machine->tree.n_bodies();
    if (sample % 2) machine->close(spherical, draws.below(bodies - 1), bodies - 1, draws);
    expect_motion(*machine, sample, machine->make_consistent());
  }
}

// All rods turn alike: (n + 1) / 3 + n times the angular acceleration is the torque of gravity.
TEST(ArticulatedLoops, RowsOfFourBarsOfAnyLength) {
  for (const int n : {1, 2, 12, 13, 40, 300}) {
    SCOPED_TRACE(n);
    const ModelSpec spec = row_of_four_bars(n);
    LoopedMachine machine(spec);
    for (int i = 0; i < machine.tree.nv(); ++i) machine.v[i] = i % 2 == 0 ? 0.7 : -0.7;
    if (n <= 40) expect_motion(machine, 3, 2 * n);
    const std::vector<double> tau(machine.tree.nv());
    SweepInput<double> in = machine.input();
    in.tau = tau.data();
    std::vector<double> du(machine.tree.nv());
    ArticulatedLoops kernel(machine.model);
    ASSERT_TRUE(kernel.evaluate(in, du.data(), nullptr));
    if (n <= 40) {
      EXPECT_EQ(find_indeterminacy(machine.model, machine.q.data()).rank, 2 * n);
    }
    const double inertia = (n + 1) * (0.1 + 0.25) + n;
    const double torque = -spec.gravity.x * ((n + 1) * 0.5 + n);
    for (int i = 0; i < machine.tree.nv(); ++i)
      EXPECT_NEAR(du[i], (i % 2 == 0 ? 1 : -1) * torque / inertia, 1e-10);
  }
}

// Each joint and its copy share what they carry: least energy halves it, whatever D is. Groups of
// more than 64 rows are factored another way than smaller ones.
TEST(ArticulatedLoops, JointsThatRepeatEachOtherShareTheirLoad) {
  for (const int copies : {2, 12, 20}) {
    SCOPED_TRACE(copies);
    Draws draws(7 + copies);
    const std::vector<JointType> types(60, JointType::revolute);
    LoopedMachine machine(tree_spec(types, random_parents(60, draws), draws), draws);
    for (int l = 0; l < copies; ++l) {
      machine.close(l % 2 ? JointType::spherical : JointType::universal, 3 * l, 59 - l, draws);
      machine.close_again();
    }
    const int rank = machine.make_consistent();
    EXPECT_LE(rank, 3 * copies + copies / 2);
    const DynamicsCase c(machine.tree, 4);
    SweepInput<double> in = machine.input();
    in.tau = c.tau.data();
    std::vector<double> du(machine.model.nv()), loads(6 * machine.model.n_loads());
    ArticulatedLoops kernel(machine.model);
    ASSERT_TRUE(kernel.evaluate(in, du.data(), loads.data()));
    EXPECT_EQ(kernel.report().rank, rank);
    int rows = 0;
    for (const LoopGroup& group : kernel.groups()) rows = std::max(rows, group.rows);
    EXPECT_EQ(rows > 64, copies > 2);
    const double* const of_loops = &loads[6 * machine.model.n_joints()];
    double largest = 0;
    for (int i = 0; i < 12 * copies; ++i) largest = std::max(largest, std::abs(of_loops[i]));
    EXPECT_GT(largest, 1);
    for (int l = 0; l < copies; ++l)
      for (int i = 0; i < 6; ++i)
        EXPECT_NEAR(of_loops[12 * l + i], of_loops[12 * l + 6 + i], 1e-5 * largest);
    expect_motion(machine, 4, rank);
  }
}

TEST(ArticulatedLoops, RandomTreesWithSeveralLoops) {
  for (int sample = 0; sample < 60; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(100 + sample);
    const int n = 4 + draws.below(14);
    ModelSpec spec = tree_spec(random_types(n, draws), random_parents(n, draws), draws);
    spec.floating_base = sample % 3 == 0;
    LoopedMachine machine(spec, draws);
    const int bodies = machine.tree.n_bodies();
    if (bodies < 2) continue;
    const int loops = 1 + draws.below(4);
    for (int l = 0; l < loops; ++l) {
      const int a = draws.below(bodies + 1) - 1;
      int b = draws.below(bodies + 1) - 1;
      if (a == b) b = a < bodies - 1 ? a + 1 : a - 1;
      machine.close(all_joint_types[draws.below(static_cast<int>(JointType::composite))], a, b,
                    draws);
      if (sample % 4 == 1 && l == 0) machine.close_again();
    }
    expect_motion(machine, sample, machine.make_consistent());
  }
}

}  // namespace
}  // namespace linkwise::testing
