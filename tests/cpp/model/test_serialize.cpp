#include <string>

#include <gtest/gtest.h>

#include "linkwise/base/error.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

/// Everything that a description can hold, in few bytes.
ModelSpec full_spec() {
  Draws draws(11);
  ModelSpec spec = tree_spec({JointType::composite, JointType::spherical}, {-1, 0}, draws);
  spec.name = "a";
  spec.source = "file with spaces.urdf";
  spec.floating_base = true;
  spec.keep_fixed = true;
  spec.prescribed = {"joint1"};
  spec.notes = {{NoteLevel::info, "lamp", "not read"}};
  spec.links.push_back(random_link("tip", draws));
  spec.joints.push_back(random_joint(JointType::revolute, "j", "base", "tip", draws));
  spec.loop_joints = {{random_joint(JointType::universal, "loop", "link1", "tip", draws),
                       random_rotation(draws), random_vector3(draws), LoopKind::rod, 0.7}};
  spec.couplings = {{"gear", {{"joint0", 2}, {"j", -1}}, 0.5}};
  spec.joints[0].dof = {{DofProperty::lower, {-infinity, -1, 0}}, {DofProperty::armature, {0.5}}};
  return spec;
}

TEST(Serialize, ComesBackAsItWas) {
  for (const Machine& machine : all_machines()) {
    const std::string bytes = serialize(machine.spec);
    EXPECT_EQ(serialize(deserialize(bytes)), bytes) << machine.name;
  }
  const ModelSpec back = deserialize(serialize(full_spec())), spec = full_spec();
  EXPECT_EQ(back.source, spec.source);
  EXPECT_EQ(back.prescribed, spec.prescribed);
  ASSERT_EQ(back.notes.size(), 1u);
  EXPECT_EQ(back.notes[0].text, "not read");
  EXPECT_TRUE(back.floating_base);
  EXPECT_TRUE(back.keep_fixed);
  EXPECT_EQ(back.joints[0].dof[0].values, spec.joints[0].dof[0].values);
  EXPECT_EQ(back.joints[1].rotation.m[5], spec.joints[1].rotation.m[5]);
  EXPECT_EQ(back.links[2].inertia.m[4], spec.links[2].inertia.m[4]);
  ASSERT_EQ(back.loop_joints.size(), 1u);
  EXPECT_EQ(back.loop_joints[0].joint.child, "tip");
  EXPECT_EQ(back.loop_joints[0].child_rotation.m[7], spec.loop_joints[0].child_rotation.m[7]);
  EXPECT_EQ(back.loop_joints[0].child_translation.z, spec.loop_joints[0].child_translation.z);
  ASSERT_EQ(back.couplings.size(), 1u);
  EXPECT_EQ(back.couplings[0].terms[1].joint, "j");
  EXPECT_EQ(back.couplings[0].offset, 0.5);
}

TEST(Serialize, CutShortAnywhereIsAnInputError) {
  const std::string bytes = serialize(full_spec());
  for (size_t length = 0; length < bytes.size(); ++length)
    EXPECT_THROW(deserialize(bytes.substr(0, length)), InputError) << length;
  EXPECT_THROW(deserialize(bytes + '\0'), InputError);
}

// Whatever was damaged, a model comes out or an InputError does.
TEST(Serialize, DamagedBytesDoNoHarm) {
  const std::string bytes = serialize(full_spec());
  for (size_t at = 0; at < bytes.size(); ++at)
    for (const int flip : {0x01, 0x40, 0xff}) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      try {
        Model model(deserialize(damaged));
        EXPECT_GE(model.nv(), 0);
      } catch (const InputError& error) {
        EXPECT_NE(std::string(error.what()), "");
      }
    }
}

}  // namespace
}  // namespace linkwise::testing
