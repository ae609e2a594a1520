// Joints that close loops: where their frames lie on the bodies, whatever the model did to these.
#include <cmath>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "linkwise/kinematics/body_state.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

using Xform = Transform<double>;

Xform inverse(const Xform& X) { return {transpose(X.R), -(X.R * X.r)}; }

/// World -> link frames at the zero position, from the spec alone.
std::vector<Xform> zero_poses(const ModelSpec& spec) {
  std::vector<Xform> poses(spec.links.size(), Xform{Mat3<double>::identity(), {}});
  const auto index = [&](const std::string& name) {
    size_t i = 0;
    while (spec.links[i].name != name) ++i;
    return i;
  };
  for (const JointSpec& j : spec.joints)
    poses[index(j.child)] = Xform{transpose(j.rotation), j.translation} * poses[index(j.parent)];
  return poses;
}

/// World -> body frames.
std::vector<Xform> body_poses(const Model& model, const std::vector<double>& q) {
  std::vector<BodyState<double>> states(model.n_bodies());
  std::vector<GeneralState<double>> general(model.n_general);
  SweepInput<double> in;
  in.q = q.data();
  calc_body_states(model, in, states.data(), general.data());
  std::vector<Xform> poses;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const int parent = model.topology[n].parent;
    poses.push_back(parent < 0 ? states[n].X : states[n].X * poses[parent]);
  }
  return poses;
}

/// What the joint's elements make of E at its zero coordinates, world -> F.
Xform across(const Model& model, const LoopJoint& loop, Xform X) {
  std::vector<double> q(model.loops.nq, 0.0);
  for (const Element& e : model.loops.elements)
    if (const int own = info_of(e.kind).quaternion; own >= 0) q[e.q + own + 3] = 1;
  for (int k = 0; k < loop.joint.n_elements; ++k)
    X = element_pose(model.loops.elements[loop.joint.first_element + k], q.data()) * X;
  return X;
}

double distance(const Xform& a, const Xform& b) {
  double worst =
      std::max({std::abs(a.r.x - b.r.x), std::abs(a.r.y - b.r.y), std::abs(a.r.z - b.r.z)});
  for (int i = 0; i < 9; ++i) worst = std::max(worst, std::abs(a.R.m[i] - b.R.m[i]));
  return worst;
}

/// Two branches on the base, of hinges and other joints, whose tips a joint of this type joins.
ModelSpec two_branches(JointType type, Draws& draws) {
  using enum JointType;
  ModelSpec spec = tree_spec({revolute, revolute, universal, revolute, revolute, fixed, helical},
                             {-1, 0, 1, -1, 3, 4, 5}, draws);
  const std::vector<Xform> poses = zero_poses(spec);
  LoopJointSpec loop;
  loop.joint = random_joint(type, "loop", "link2", "link6", draws);
  const Xform E = Xform{transpose(loop.joint.rotation), loop.joint.translation} * poses[3];
  const Xform from_child = E * inverse(poses[7]);
  loop.child_rotation = transpose(from_child.R);
  loop.child_translation = from_child.r;
  spec.loop_joints.push_back(loop);
  return spec;
}

TEST(Loops, TheFramesOfBothBodiesMeetWhereTheyShould) {
  Draws draws(3);
  for (const JointType type : all_joint_types) {
    if (type == JointType::composite) continue;
    const Model model(two_branches(type, draws));
    ASSERT_EQ(model.n_loops(), 1);
    const LoopJoint& loop = model.loops.joints[0];
    EXPECT_EQ(model.links[loop.parent_link].name, "link2");
    EXPECT_EQ(model.links[loop.joint.link].name, "link6");
    EXPECT_EQ(loop.joint.nv, joint_dof(model.spec_of(loop.joint)));
    const std::vector<Xform> poses = body_poses(model, model.neutral_configuration());
    const Xform E = loop.on_parent * poses[loop.parent_body];
    EXPECT_LT(distance(across(model, loop, E), loop.on_child * poses[loop.joint.body]), 1e-14)
        << joint_type_name(type);
  }
}

// A link with two parents: its second joint lies in the child's frame, as the first does.
TEST(Loops, ALinkWithTwoParentsIsALoop) {
  Draws draws(4);
  using enum JointType;
  ModelSpec spec = tree_spec({revolute, revolute, revolute}, {-1, 0, -1}, draws);
  const std::vector<Xform> poses = zero_poses(spec);
  JointSpec second = random_joint(spherical, "second", "link2", "link1", draws);
  const Xform from_parent = poses[2] * inverse(poses[3]);
  second.rotation = transpose(from_parent.R);
  second.translation = from_parent.r;
  spec.joints.push_back(second);
  const Model model(spec);
  ASSERT_EQ(model.n_loops(), 1);
  EXPECT_EQ(model.n_bodies(), 3);
  const LoopJoint& loop = model.loops.joints[0];
  EXPECT_EQ(loop.joint.name, "second");  // with more freedom than joint1
  const std::vector<Xform> bodies = body_poses(model, model.neutral_configuration());
  EXPECT_LT(distance(across(model, loop, loop.on_parent * bodies[loop.parent_body]),
                     loop.on_child * bodies[loop.joint.body]),
            1e-14);
  EXPECT_THROW(refuse_loops(model, "this method"), InputError);
}

TEST(Loops, OneEndMayBeTheGround) {
  Draws draws(5);
  using enum JointType;
  ModelSpec spec = tree_spec({revolute, revolute}, {-1, 0}, draws);
  const std::vector<Xform> poses = zero_poses(spec);
  LoopJointSpec loop;
  loop.joint = random_joint(revolute, "pin", "link1", "base", draws);
  const Xform E = Xform{transpose(loop.joint.rotation), loop.joint.translation} * poses[2];
  loop.child_rotation = transpose(E.R);
  loop.child_translation = E.r;
  spec.loop_joints.push_back(loop);
  const Model model(spec);
  const LoopJoint& pin = model.loops.joints.at(0);
  EXPECT_EQ(pin.joint.body, -1);
  const std::vector<Xform> bodies = body_poses(model, model.neutral_configuration());
  EXPECT_LT(distance(across(model, pin, pin.on_parent * bodies[pin.parent_body]), pin.on_child),
            1e-14);
}

}  // namespace
}  // namespace linkwise::testing
