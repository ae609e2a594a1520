#pragma once
// The user's description of a machine: links and joints by name, in the user's frames. ModelBuilder
// collects it; the constructor of Model turns it into the arrays that the sweeps run over.
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "linkwise/bodies/body_kinds.hpp"

namespace linkwise {

/// In the order of joint_type_table. Models are stored with these numbers, so new types go last.
enum class JointType {
  fixed,
  revolute,
  continuous,
  prismatic,
  helical,
  cylindrical,
  universal,
  spherical,
  planar,
  floating,
  composite,
  elastic,  ///< holds its child on the port of an elastic body, whose coordinates are its own
};
inline constexpr int n_joint_types = static_cast<int>(JointType::elastic) + 1;

/// One screw axis of a stack, in the joint frame.
enum class AxisKind { revolute, prismatic, helical };
struct AxisSpec {
  AxisKind kind = AxisKind::revolute;
  Vec3<double> axis{0, 0, 1};
  double pitch = 0;  ///< m/rad, helical only
};

struct LinkSpec {
  std::string name;
  double mass = 0;       ///< kg
  Vec3<double> com;      ///< centre of mass in the link frame, m
  Sym3<double> inertia;  ///< about the centre of mass, link axes, kg m^2
  BodyKind body_kind = BodyKind::rigid;
  std::vector<double> parameters = {};  ///< of its kind, in the link frame
};

/// Properties that a joint has once per degree of freedom; one value stands for all of them. Models
/// are stored with these numbers, so new ones go last.
enum class DofProperty {
  damping,            ///< N m s/rad or N s/m
  friction,           ///< Coulomb level, N m or N
  friction_velocity,  ///< speed below which Coulomb friction is smoothed: level * tanh(u / speed)
  stiffness,          ///< spring to rest_position, N m/rad or N/m
  rest_position,
  armature,  ///< rotor inertia seen at the joint, kg m2 or kg
  lower,
  upper,
  effort,
  velocity,
  limit_stiffness,  ///< of the compliant stops at lower and upper; 0: limits exert no force
  limit_damping,    ///< s/rad or s/m: stop force = limit_stiffness * depth * (1 + limit_damping *
                    ///< speed)
};
inline constexpr int n_dof_properties = 12;

struct DofPropertyEntry {
  const char* name;
  double fallback;
  bool infinite_ok, negative_ok;
  const char* text;  ///< meaning and units, turning and sliding
};
inline constexpr double infinity = std::numeric_limits<double>::infinity();
inline constexpr DofPropertyEntry dof_property_table[n_dof_properties] = {
    {"damping", 0, false, false, "Viscous damping (nv,) [N m s/rad, N s/m]."},
    {"friction", 0, false, false, "Level of Coulomb friction (nv,) [N m, N]."},
    {"friction_velocity", 0.01, false, false,
     "Rate (nv,) [rad/s, m/s] below which friction is smoothed: friction tanh(v / "
     "friction_velocity)."},
    {"stiffness", 0, false, false, "Spring to rest_position (nv,) [N m/rad, N/m]."},
    {"rest_position", 0, false, true, "Where the spring is without force (nv,) [rad, m]."},
    {"armature", 0, false, false, "Inertia of the rotor, seen at the joint (nv,) [kg m2, kg]."},
    {"lower", -infinity, true, true, "Lower end of the range (nv,) [rad, m]."},
    {"upper", infinity, true, true, "Upper end of the range (nv,) [rad, m]."},
    {"effort", infinity, true, false, "Largest torque of the drive (nv,) [N m, N]; not enforced."},
    {"velocity", infinity, true, false, "Largest rate (nv,) [rad/s, m/s]; not enforced."},
    {"limit_stiffness", 0, false, false,
     "Stiffness of the stops at both ends (nv,) [N m/rad, N/m]; 0: the range exerts no force."},
    {"limit_damping", 0, false, false,
     "Damping of the stops (nv,) [s/rad, s/m]: limit_stiffness depth (1 + limit_damping speed)."},
};

/// Throws InputError where the name is unknown.
DofProperty dof_property_from_name(const std::string& name);

/// Only what differs from the table's fallbacks, so that a million plain joints stay small.
struct DofValue {
  DofProperty property;
  std::vector<double> values;
};

struct JointSpec {
  std::string name;
  JointType type = JointType::revolute;
  std::string parent, child;
  /// Of an elastic joint, those of its parent, and its kind; validate() finds them.
  int n_coordinates = 0;
  BodyKind parent_kind = BodyKind::rigid;
  Mat3<double> rotation =
      Mat3<double>::identity();  ///< joint axes in the parent link frame (columns)
  Vec3<double> translation;      ///< joint point in the parent link frame, m
  std::vector<AxisSpec> axes;    ///< one for the 1-DOF types and planar (its normal)
  std::vector<DofValue> dof;
  std::vector<double> initial;  ///< coordinates where it starts; empty: the zero position
};

/// What stands between two links of a loop: a joint, or one of two things without mass between two
/// points. A rod holds their distance. A spring holds nothing; its coordinate is how much their
/// distance is more than its length.
enum class LoopKind : unsigned char { joint, rod, spring };
inline constexpr int n_loop_kinds = 3;

/// A joint that closes a loop, whatever else its links hang on: its point and axes are given on
/// both links. `joint` places them on the parent.
struct LoopJointSpec {
  JointSpec joint;
  Mat3<double> child_rotation =
      Mat3<double>::identity();     ///< joint axes in the child link frame (columns)
  Vec3<double> child_translation;   ///< joint point in the child link frame, m
  LoopKind kind = LoopKind::joint;  ///< the type of a rod's joint is fixed, of a spring's prismatic
  double length = 0;                ///< of a rod or a spring, m
};

/// Coordinates of joints with one degree of freedom that go together, as gears, racks,
/// differentials and cams make them: the sum of a polynomial of each, without a constant, = offset.
struct CouplingSpec {
  struct Term {
    std::string joint;
    double factor;       ///< of its coordinate [rad, m]
    double higher[3]{};  ///< of its second, third and fourth power
  };
  std::string name;
  std::vector<Term> terms;
  double offset = 0;
};

/// How much a joint yields to its load, on top of the motions that it leaves: stiffness across and
/// along an axis in the joint's frame, against tilting the axis and against turning about it.
/// It moves nothing, and decides what rigid bodies leave open: dynamics/bearing_shares.hpp.
/// A misfit is where the child would stand against the parent without load, past where the joint
/// has it: in the parent's axes of the joint, and along the bearing's axis. A preload is the load
/// that makes a misfit of the stiffness times it.
struct BearingSpec {
  std::string joint;
  double radial = infinity, axial = infinity;  ///< N/m
  double tilt = infinity, torsion = infinity;  ///< N m/rad
  Vec3<double> axis{};                         ///< 0: the joint's own
  Vec3<double> offset{}, turn{}, preload{};    ///< m, rad, N
  double offset_along = 0, preload_along = 0;  ///< m, N, besides

  bool has_misfit() const {
    return dot(offset, offset) + dot(turn, turn) + dot(preload, preload) > 0 || offset_along != 0 ||
           preload_along != 0;
  }
};

enum class NoteLevel { merge, warning, info };
const char* note_level_name(NoteLevel level);
NoteLevel note_level_from_name(const std::string& name);
/// What building a model merged, what to beware of, what a reader left out.
struct Note {
  NoteLevel level;
  std::string element, text;
};

struct ModelSpec {
  std::string name = "model", source;
  Vec3<double> gravity{0, 0, -9.81};
  bool floating_base = false;
  std::string floating_joint = "root_joint";
  bool keep_fixed = false;
  std::vector<std::string> prescribed;  ///< joints whose motion is given; see Model
  std::vector<LinkSpec> links;
  std::vector<JointSpec> joints;
  std::vector<LoopJointSpec> loop_joints;
  std::vector<CouplingSpec> couplings;
  std::vector<BearingSpec> bearings;
  std::vector<Note> notes;  ///< of whoever read the model from a file
};

/// Joint j of a spec whose loop joints stand behind the others, and what stands behind them all.
inline const JointSpec& joint_of(const ModelSpec& spec, int j, const JointSpec& last) {
  const auto n = static_cast<int>(spec.joints.size()),
             n_loops = static_cast<int>(spec.loop_joints.size());
  return j < n ? spec.joints[j] : j < n + n_loops ? spec.loop_joints[j - n].joint : last;
}

/// " of arm.urdf" or "": the tail of messages about an element of this machine.
inline std::string source_of(const ModelSpec& spec) {
  return spec.source.empty() ? "" : " of " + spec.source;
}

std::string serialize(const ModelSpec& spec);
ModelSpec deserialize(const std::string& bytes);

}  // namespace linkwise
