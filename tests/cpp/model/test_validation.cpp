// Every message that a wrong model gets, word for word.
#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "base/error_of.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/model/model.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise::testing {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

LinkSpec body(const std::string& name) { return {name, 2, {0.1, 0, 0}, {{1, 0, 1, 0, 0, 1}}}; }

JointSpec joint(const std::string& name, JointType type, const std::string& parent,
                const std::string& child) {
  JointSpec j;
  j.name = name;
  j.type = type;
  j.parent = parent;
  j.child = child;
  j.axes = {{}, {AxisKind::revolute, {1, 0, 0}, 0}};
  return j;
}

/// base - shoulder (revolute) - upper - elbow (spherical) - lower
ModelSpec arm() {
  ModelSpec spec;
  spec.name = "arm";
  spec.source = "arm.urdf";
  spec.links = {body("base"), body("upper"), body("lower")};
  spec.joints = {joint("shoulder", JointType::revolute, "base", "upper"),
                 joint("elbow", JointType::spherical, "upper", "lower")};
  return spec;
}

struct Wrong {
  const char* name;
  void (*change)(ModelSpec&);
  const char* message;
};
void PrintTo(const Wrong& wrong, std::ostream* out) { *out << wrong.name; }

void set_dof(ModelSpec& s, int joint, DofProperty property, std::vector<double> values) {
  s.joints[joint].dof.push_back({property, std::move(values)});
}

const Wrong wrong_links[] = {
    {"link_without_name", [](ModelSpec& s) { s.links[1].name = ""; },
     "a link of arm.urdf has an empty name; give every link a name"},
    {"mass_not_a_number", [](ModelSpec& s) { s.links[1].mass = nan; },
     "link 'upper' of arm.urdf: mass is not a finite number; give a mass in kg"},
    {"mass_infinite", [](ModelSpec& s) { s.links[1].mass = infinity; },
     "link 'upper' of arm.urdf: mass is not a finite number; give a mass in kg"},
    {"mass_negative", [](ModelSpec& s) { s.links[1].mass = -1e-9; },
     "link 'upper' of arm.urdf: mass is negative (-1e-09); give a mass >= 0 in kg"},
    {"com_infinite", [](ModelSpec& s) { s.links[1].com.z = -infinity; },
     "link 'upper' of arm.urdf: centre of mass is not finite; give three finite numbers in m"},
    {"inertia_not_a_number", [](ModelSpec& s) { s.links[2].inertia.m[3] = nan; },
     "link 'lower' of arm.urdf: inertia is not finite; give finite numbers in kg m2"},
    {"inertia_indefinite",
     [](ModelSpec& s) {
       s.links[2].inertia = {{1, 2, 1, 0, 0, 1}};
     },
     "link 'lower' of arm.urdf: inertia has a negative principal moment (-1 kg m2); give a "
     "positive semidefinite inertia about the centre of mass"},
    {"link_name_twice", [](ModelSpec& s) { s.links[2].name = "upper"; },
     "link 'upper' of arm.urdf: the name is used twice; rename one of them"},
    {"no_links", [](ModelSpec& s) { s.links.clear(); },
     "model 'arm' of arm.urdf has no links; add at least one"},
    {"gravity_not_a_number", [](ModelSpec& s) { s.gravity.y = nan; },
     "model 'arm' of arm.urdf: gravity is not finite; give three finite numbers in m/s2"},
};

const Wrong wrong_joints[] = {
    {"joint_without_name", [](ModelSpec& s) { s.joints[0].name = ""; },
     "a joint of arm.urdf has an empty name; give every joint a name"},
    {"joint_name_twice", [](ModelSpec& s) { s.joints[1].name = "shoulder"; },
     "joint 'shoulder' of arm.urdf: the name is used twice; rename one of them"},
    {"translation_infinite", [](ModelSpec& s) { s.joints[0].translation.x = infinity; },
     "joint 'shoulder' of arm.urdf: translation is not finite; give three finite numbers in m"},
    {"rotation_not_a_number", [](ModelSpec& s) { s.joints[0].rotation.m[4] = nan; },
     "joint 'shoulder' of arm.urdf: rotation is not finite; give a 3x3 rotation matrix"},
    {"rotation_scaled", [](ModelSpec& s) { s.joints[0].rotation.m[0] = 1.001; },
     "joint 'shoulder' of arm.urdf: rotation is not a rotation matrix; give an orthonormal "
     "right-handed 3x3 matrix"},
    {"rotation_left_handed", [](ModelSpec& s) { s.joints[0].rotation.m[0] = -1; },
     "joint 'shoulder' of arm.urdf: rotation is not a rotation matrix; give an orthonormal "
     "right-handed 3x3 matrix"},
    {"no_axis", [](ModelSpec& s) { s.joints[0].axes.clear(); },
     "joint 'shoulder' of arm.urdf: has 0 axes; a revolute joint needs 1"},
    {"one_axis_of_two",
     [](ModelSpec& s) {
       s.joints[0].type = JointType::universal;
       s.joints[0].axes.resize(1);
     },
     "joint 'shoulder' of arm.urdf: has 1 axes; a universal joint needs 2"},
    {"empty_composite",
     [](ModelSpec& s) {
       s.joints[0].type = JointType::composite;
       s.joints[0].axes.clear();
     },
     "joint 'shoulder' of arm.urdf: has 0 axes; a composite joint needs at least one"},
    {"seven_axes",
     [](ModelSpec& s) {
       s.joints[0].type = JointType::composite;
       s.joints[0].axes.resize(7);
     },
     "joint 'shoulder' of arm.urdf: has 7 degrees of freedom; a joint can have 6 at most"},
    {"axis_infinite", [](ModelSpec& s) { s.joints[0].axes[0].axis.x = infinity; },
     "joint 'shoulder' of arm.urdf: axis is not finite; give three finite numbers"},
    {"axis_zero", [](ModelSpec& s) { s.joints[0].axes[0].axis = {}; },
     "joint 'shoulder' of arm.urdf: axis has zero length; give a nonzero axis"},
    {"pitch_not_a_number",
     [](ModelSpec& s) {
       s.joints[0].type = JointType::helical;
       s.joints[0].axes[0].pitch = nan;
     },
     "joint 'shoulder' of arm.urdf: pitch is not finite; give the advance in m per rad"},
    {"unknown_parent", [](ModelSpec& s) { s.joints[0].parent = "bass"; },
     "joint 'shoulder' of arm.urdf: parent link 'bass' does not exist; did you mean 'base'?"},
    {"unknown_child", [](ModelSpec& s) { s.joints[1].child = "gripper"; },
     "joint 'elbow' of arm.urdf: child link 'gripper' does not exist; known: base, upper, lower"},
    {"loop_of_welds",
     [](ModelSpec& s) {
       for (const char* child : {"upper", "lower"})
         s.joints.push_back(joint(std::string("extra_") + child, JointType::fixed, "base", child));
     },
     "joint 'shoulder' of arm.urdf joins links 'base' and 'upper', which fixed joints make one "
     "body; remove the joint"},
    {"composite_loop",
     [](ModelSpec& s) {
       s.joints.push_back(joint("extra", JointType::composite, "base", "lower"));
       s.joints.back().axes.assign(4, {});
       s.joints[1].type = JointType::composite;
     },
     "joint 'extra' of arm.urdf is composite and closes a loop of joints 'extra', 'elbow' and "
     "'shoulder'; let a joint of another type lead to link 'lower', which then closes the loop"},
    {"two_roots", [](ModelSpec& s) { s.joints.pop_back(); },
     "links 'base' and 'lower' of arm.urdf both have no parent; a model has one root: join them "
     "with a joint"},
    {"cycle_apart",
     [](ModelSpec& s) {
       s.links.push_back(body("left"));
       s.links.push_back(body("right"));
       s.joints.push_back(joint("there", JointType::revolute, "left", "right"));
       s.joints.push_back(joint("back", JointType::revolute, "right", "left"));
     },
     "joint 'back' of arm.urdf closes a loop of joints 'there' and 'back' that hangs on nothing; "
     "join link 'left' to the rest"},
    {"own_child", [](ModelSpec& s) { s.joints[1].parent = "lower"; },
     "joint 'elbow' of arm.urdf: link 'lower' is its parent and its child; give it two links"},
    {"floating_name_taken",
     [](ModelSpec& s) {
       s.floating_base = true;
       s.floating_joint = "elbow";
     },
     "joint 'elbow' of arm.urdf: the floating base needs this name; rename the joint"},
    {"prescribed_unknown", [](ModelSpec& s) { s.prescribed = {"elbo"}; },
     "joint 'elbo' does not exist in model 'arm' of arm.urdf; did you mean 'elbow'?"},
};

const Wrong wrong_properties[] = {
    {"wrong_number",
     [](ModelSpec& s) {
       set_dof(s, 1, DofProperty::damping, {1, 2});
     },
     "joint 'elbow' of arm.urdf: damping has 2 values but the joint has 3 degrees of freedom; give "
     "one value or 3"},
    {"damping_not_a_number", [](ModelSpec& s) { set_dof(s, 0, DofProperty::damping, {nan}); },
     "joint 'shoulder' of arm.urdf: damping is not a finite number; give a finite value"},
    {"damping_negative", [](ModelSpec& s) { set_dof(s, 0, DofProperty::damping, {-1}); },
     "joint 'shoulder' of arm.urdf: damping is negative (-1); give a value >= 0"},
    {"armature_infinite", [](ModelSpec& s) { set_dof(s, 0, DofProperty::armature, {infinity}); },
     "joint 'shoulder' of arm.urdf: armature is not a finite number; give a finite value"},
    {"effort_negative", [](ModelSpec& s) { set_dof(s, 0, DofProperty::effort, {-infinity}); },
     "joint 'shoulder' of arm.urdf: effort is negative (-inf); give a value >= 0"},
    {"limit_not_a_number", [](ModelSpec& s) { set_dof(s, 0, DofProperty::lower, {nan}); },
     "joint 'shoulder' of arm.urdf: lower is not a finite number; give a finite value"},
    {"limits_swapped",
     [](ModelSpec& s) {
       set_dof(s, 0, DofProperty::lower, {1});
       set_dof(s, 0, DofProperty::upper, {-1});
     },
     "joint 'shoulder' of arm.urdf: lower limit 1 is above the upper limit -1; swap them, or "
     "leave both out where there is no limit"},
    {"friction_not_smooth",
     [](ModelSpec& s) {
       set_dof(s, 0, DofProperty::friction, {1});
       set_dof(s, 0, DofProperty::friction_velocity, {0});
     },
     "joint 'shoulder' of arm.urdf: friction_velocity is zero; give the speed below which friction "
     "is smoothed"},
    {"spring_on_a_quaternion", [](ModelSpec& s) { set_dof(s, 1, DofProperty::stiffness, {5}); },
     "joint 'elbow' of arm.urdf: springs and limits need an angle or a distance; use a composite "
     "joint of axes instead of spherical"},
    {"stop_on_a_quaternion",
     [](ModelSpec& s) {
       s.joints[1].type = JointType::floating;
       set_dof(s, 1, DofProperty::limit_stiffness, {0, 0, 5, 0, 0, 0});
     },
     "joint 'elbow' of arm.urdf: springs and limits need an angle or a distance; use a composite "
     "joint of axes instead of floating"},
};

class WrongModel : public ::testing::TestWithParam<Wrong> {};

TEST_P(WrongModel, GetsOneClearLine) {
  const Wrong wrong = GetParam();
  ModelSpec spec = arm();
  wrong.change(spec);
  EXPECT_EQ(error_of([&] { Model model(spec); }), wrong.message);
  // Without a source the message says the same without naming one.
  ModelSpec unnamed = arm();
  wrong.change(unnamed);
  unnamed.source.clear();
  std::string message = wrong.message;
  if (const size_t at = message.find(" of arm.urdf"); at != std::string::npos)
    message.erase(at, std::string(" of arm.urdf").size());
  EXPECT_EQ(error_of([&] { Model model(unnamed); }), message);
}

const auto name_of = [](const auto& test) { return std::string(test.param.name); };
INSTANTIATE_TEST_SUITE_P(Links, WrongModel, ::testing::ValuesIn(wrong_links), name_of);
INSTANTIATE_TEST_SUITE_P(Joints, WrongModel, ::testing::ValuesIn(wrong_joints), name_of);
INSTANTIATE_TEST_SUITE_P(Properties, WrongModel, ::testing::ValuesIn(wrong_properties), name_of);

TEST(Validation, TheUnchangedArmIsFine) {
  EXPECT_EQ(error_of([] { Model m(arm()); }), "no error");
}

TEST(Validation, UnknownNamesGetSuggestions) {
  const Model model(arm());
  EXPECT_EQ(error_of([&] { model.joint_index("sholder"); }),
            "joint 'sholder' does not exist in model 'arm' of arm.urdf; did you mean 'shoulder'?");
  EXPECT_EQ(error_of([&] { model.link_index("tool"); }),
            "link 'tool' does not exist in model 'arm' of arm.urdf; known: base, upper, lower");
  EXPECT_EQ(model.joint_index("elbow"), 1);
  EXPECT_EQ(model.link_index("lower"), 2);
  ModelSpec rock;
  rock.links = {body("rock")};
  EXPECT_EQ(error_of([&] { Model(rock).joint_index("hinge"); }),
            "joint 'hinge' does not exist in model 'model'; there are none");
  EXPECT_EQ(suggest("zzzzzz", {"a", "b", "c", "d", "e", "f", "g", "h", "i"}),
            "; known: a, b, c, d, e, f, g, h, ...");
}

TEST(Validation, JointTypesGoByTheirNames) {
  EXPECT_EQ(error_of([] { joint_type_from_name("ball"); }),
            "joint type 'ball' is unknown; known: fixed, revolute, continuous, prismatic, helical, "
            "cylindrical, universal, spherical, planar, floating, composite, elastic");
  for (const char* name : {"fixed", "revolute", "continuous", "prismatic", "helical", "cylindrical",
                           "universal", "spherical", "planar", "floating", "composite"})
    EXPECT_STREQ(joint_type_name(joint_type_from_name(name)), name);
}

TEST(Validation, AxesOfAnySizeAreNormalised) {
  for (double size : {1e-300, 1e-5, 1.0, 1e5, 1e300}) {
    JointSpec j = joint("hinge", JointType::revolute, "a", "b");
    j.axes[0].axis = {0, 3 * size, -4 * size};
    validate_joint(j, "");
    EXPECT_DOUBLE_EQ(j.axes[0].axis.y, 0.6);
    EXPECT_DOUBLE_EQ(j.axes[0].axis.z, -0.8);
  }
}

// From the characteristic cubic: a moment that is there once is known to rounding, one that is
// there twice to its square root, the two together to rounding again.
TEST(Validation, PrincipalMoments) {
  struct Case {
    Sym3<double> inertia;
    double moments[3];
    bool twice;
  };
  const Case cases[] = {
      {{{0, 0, 0, 0, 0, 0}}, {0, 0, 0}, false}, {{{3, 0, 1, 0, 0, 2}}, {1, 2, 3}, false},
      {{{5, 0, 5, 0, 0, 5}}, {5, 5, 5}, false}, {{{2, 1, 2, 0, 0, 2}}, {1, 2, 3}, false},
      {{{1, 0, 1, 0, 0, 0}}, {0, 1, 1}, true},  {{{1, 0, 0, 0, 0, 0}}, {0, 0, 1}, true},
      {{{0, 1, 0, 0, 0, 0}}, {-1, 0, 1}, false}};
  for (const Case& c : cases)
    for (double scale : {1e-200, 1.0, 1e200}) {
      Sym3<double> scaled = c.inertia;
      for (double& x : scaled.m) x *= scale;
      double got[3];
      principal_moments(scaled, got);
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(got[i], scale * c.moments[i], (c.twice ? 1e-8 : 1e-14) * scale);
      EXPECT_NEAR(got[0] + got[1], scale * (c.moments[0] + c.moments[1]),
                  (c.moments[1] == c.moments[2] ? 1e-8 : 1e-14) * scale);
    }
}

}  // namespace
}  // namespace linkwise::testing
