#pragma once
// Collects the links and joints of a machine into a ModelSpec, and changes a spec that is there.
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "linkwise/model/flexible_link.hpp"

namespace linkwise {

/// A link from its inertia as a full matrix; throws InputError where that is not symmetric.
LinkSpec make_link(std::string name, double mass, const Vec3<double>& com,
                   const Mat3<double>& inertia);
/// An axis of a composite joint; kind is "revolute", "prismatic" or "helical".
AxisSpec make_axis(const std::string& kind, const Vec3<double>& axis, double pitch);

/// Names of dof_property_table, or motor_inertia and gear_ratio, with one value, or one per degree
/// of freedom, or nothing.
using Properties = std::vector<std::pair<std::string, std::optional<std::vector<double>>>>;

/// Gives a joint these properties; what is not named stays. motor_inertia J [kg m2] behind a gear
/// of gear_ratio g (1 unless given) [rad/rad, rad/m] is the armature g^2 J. Throws InputError where
/// a name is unknown or the armature is given in both ways.
void set_properties(JointSpec& joint, Properties properties);

class ModelBuilder {
 public:
  ModelBuilder(std::string name, const Vec3<double>& gravity, std::string source);

  void add_link(LinkSpec link) { spec_.links.push_back(std::move(link)); }

  /// A joint of a type given by its name; without axes it takes z, unless it is composite. Pitch is
  /// that of a helical joint, m/rad. Throws InputError where the type or a property is unknown.
  void add_joint(JointSpec joint, const std::string& type, double pitch, Properties properties);

  /// The same for a joint that closes a loop: its links hang on other joints.
  void add_loop_joint(LoopJointSpec loop, const std::string& type, double pitch,
                      Properties properties);

  /// A rod of this length [m] without mass between the points of `loop`; 0 and less throw
  /// InputError.
  void add_rod(LoopJointSpec loop, double length);
  /// A spring and damper between the points of `loop`, without mass, slack at this length [m]; its
  /// properties are those of a prismatic joint.
  void add_spring(LoopJointSpec loop, double length, Properties properties);
  void add_coupling(CouplingSpec coupling) { spec_.couplings.push_back(std::move(coupling)); }

  /// Once all joints are there: spec() does it. Throws then as FlexibleLinks::add.
  void make_flexible(FlexibleLink flexible) { flexible_.emplace_back(std::move(flexible)); }
  void make_flexible(ModalLink flexible) { flexible_.emplace_back(std::move(flexible)); }

  /// level: "merge", "warning" or "info".
  void add_note(const std::string& level, std::string element, std::string text);
  void set_floating_base(std::string joint_name);

  /// What was collected; the constructor of Model checks it.
  ModelSpec spec(bool keep_fixed = false) const;

 private:
  void complete(JointSpec& joint, const std::string& type, double pitch,
                Properties properties) const;

  ModelSpec spec_;
  std::vector<std::variant<FlexibleLink, ModalLink>> flexible_;
};

/// Links that are all the same, in a row.
struct EqualChain {
  size_t n_links = 0;
  JointType joint = JointType::revolute;
  std::vector<Vec3<double>> axes;  ///< joint i takes number i modulo their count
  Vec3<double> translation;        ///< from one joint to the next, m
  LinkSpec link;                   ///< its name does not matter
  Vec3<double> gravity;
  double damping = 0, armature = 0;
  bool floating_base = false;
};
ModelSpec make_chain(const EqualChain& chain);

/// The same machine with other properties of some of its joints, each named with its own. Throws
/// InputError where a joint has none that could be given, and as set_properties.
ModelSpec with_joints(ModelSpec spec,
                      std::vector<std::pair<std::string, Properties>> properties_of);

/// The same machine with a hinge or slider that is cylindrical or spherical instead, where it was;
/// what acts on its coordinate stays in a cylindrical one, and goes in a spherical one. Throws
/// InputError for other joints and types.
ModelSpec with_more_freedom(ModelSpec spec, const std::string& joint, JointType type);

/// The same machine with one more link welded to one of its links.
ModelSpec with_payload(ModelSpec spec, const std::string& link, LinkSpec payload);

}  // namespace linkwise
