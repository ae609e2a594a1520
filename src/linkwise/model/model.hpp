#pragma once
// The immutable description that every sweep reads: arrays over bodies (parents first), over the
// elementary motions of their joints, and the names. Built once from a ModelSpec, O(N), no
// recursion.
//
// Two levels of "joint": a user's joint (revolute ... composite) is a stack of elements; a body's
// inboard connection is the stack of all the joints between it and the nearest inboard body with
// mass, because a chain of massless links is one composite joint (docs/theory/model.md).
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "linkwise/bodies/body_kinds.hpp"
#include "linkwise/joints/element.hpp"
#include "linkwise/model/joint_types.hpp"
#include "linkwise/model/name_index.hpp"
#include "linkwise/model/spec.hpp"

namespace linkwise {

/// What is between a body and its parent, as the sweeps dispatch it: one z element, or anything
/// else. A hinge is a revolute joint without armature whose parent's frame was chosen so that the
/// placement is that of Denavit and Hartenberg; geared is revolute with armature.
enum class JointKind : std::uint8_t { hinge, revolute, geared, prismatic, helical, general };

struct BodyTopology {
  int parent = -1;  ///< body index, -1: ground
  JointKind joint_kind = JointKind::general;
  BodyKind body_kind = BodyKind::rigid;
  int of_kind = -1;  ///< index among the bodies of its kind, unless rigid
  int first_element = 0, n_elements = 0;
  int q = 0, v = 0;  ///< of bodies on one element; the others have those of their elements
  int nv = 0;        ///< of the whole stack
  int n_children = 0;
  int general = -1;  ///< index among bodies of kind general
};

template <class C>
struct BodyConstants {
  Transform<C> tree;   ///< previous frame -> body frame at zero; what one-element bodies need
  RigidBody<C> rigid;  ///< the body, where it is rigid
  C pitch{}, armature{};
  /// Of a hinge, after [denavit1955]: from the parent turn about x by alpha, go a along x and d
  /// along the new z, turn about z by q + theta.
  C cos_alpha{}, sin_alpha{}, a{}, d{}, theta{};
};

/// Bodies [begin, end) of one kind on joints of one kind.
struct KindRange {
  JointKind joint_kind;
  BodyKind body_kind;
  int begin, end;
};

/// Body n, the next one of its kind or the first of a new range.
inline void append_to_ranges(std::vector<KindRange>& ranges, const BodyTopology& body, int n) {
  if (!ranges.empty() && ranges.back().end == n && ranges.back().joint_kind == body.joint_kind &&
      ranges.back().body_kind == body.body_kind)
    ++ranges.back().end;
  else
    ranges.push_back({body.joint_kind, body.body_kind, n, n + 1});
}

/// The body itself, of kind B. Rigid ones are kept with the constants of their joints, because the
/// sweeps read both together.
template <class B, class Constants, class Bodies>
LW_INLINE auto& body_of_kind(const BodyTopology& at, Constants& constants, Bodies& others) {
  if constexpr (std::is_same_v<B, RigidBody<double>>)
    return constants.rigid;
  else
    return std::get<std::vector<B>>(others)[at.of_kind];
}

struct JointInfo {
  std::string name;
  JointType type;
  int body;  ///< the body that its stack belongs to
  int first_element = 0, n_elements = 0;
  int q = 0, nq = 0, v = 0, nv = 0;
  int link;                   ///< child link (index into links)
  int spec = -1;              ///< as of joint_of; the last one is the floating base's
  Transform<double> to_user;  ///< last element's frame -> the user's joint frame
  bool last_of_body = true;   ///< its frame is the body's frame
};

/// A joint that closes a loop of the tree. Its coordinates follow from those of the tree: they are
/// those by which its elements take the frame E of its parent nearest to the frame F of its child.
struct LoopJoint {
  JointInfo joint;       ///< its body is the child's, -1: ground; q, v, elements as in LoopJoints
  int parent_body = -1;  ///< -1: ground
  int parent_link = 0;
  Transform<double> on_parent;  ///< parent's body frame -> E, the joint's axes as given
  Transform<double> on_child;   ///< child's body frame -> F, which is the last element's frame
  LoopKind kind = LoopKind::joint;
  double length = 0;  ///< of a rod or a spring between the origins of E and F, m
};

/// All of them. Their coordinates, rates and properties are counted apart from the tree's.
struct LoopJoints {
  std::vector<LoopJoint> joints;
  std::vector<Element> elements;  ///< the first one of a joint is placed in E
  std::array<std::vector<double>, n_dof_properties> dof;
  int nq = 0, nv = 0;
};

/// Sum of polynomials of coordinates = offset.
struct Coupling {
  struct Term {
    int joint;            ///< row of its load, as Model::joint_at() takes it
    int body;             ///< that the joint belongs to
    int q, v;             ///< its coordinate and rate, in the tree's or in loop joints'
    double factor;        ///< of the coordinate
    double higher[3]{};   ///< of its second, third and fourth power
    bool closes = false;  ///< the joint closes a loop

    double value(double x) const {
      return x * (factor + x * (higher[0] + x * (higher[1] + x * higher[2])));
    }
    double slope(double x) const {
      return factor + x * (2 * higher[0] + x * (3 * higher[1] + x * 4 * higher[2]));
    }
    double curvature(double x) const {
      return 2 * higher[0] + x * (6 * higher[1] + x * 12 * higher[2]);
    }
  };
  std::string name;
  std::vector<Term> terms;
  double offset = 0;
};

/// What a joint yields to its load, in the user's joint frame.
struct Bearing {
  int load;                 ///< row of the joint's load
  Vec3<double> axis;        ///< of unit length
  double across, along;     ///< m/N, to a force; 0: rigid
  double tilting, turning;  ///< rad/(N m), to a moment across and about the axis
  /// Of a misfit, in the parent's axes of the joint, where z is along a rod. offset [m] and turn
  /// [rad]: where its child stands without load, past where the joint has it. preload [N]: a force;
  /// what the bearing yields to it is a misfit as well.
  Vec3<double> offset{}, turn{}, preload{};
  bool has_misfit = false;
};

/// Where a link of the file is: on which joint's frame (-1: ground), and how it is placed there.
struct LinkInfo {
  std::string name;
  int joint = -1;
  Transform<double> placement;  ///< joint's user frame -> link frame
};

class Model {
 public:
  /// Validates and builds. Throws InputError naming the element and the remedy.
  explicit Model(ModelSpec spec);

  const ModelSpec& spec() const { return spec_; }
  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int n_bodies() const { return static_cast<int>(topology.size()); }
  /// Of the tree.
  int n_joints() const { return static_cast<int>(joints.size()); }
  int n_loops() const { return static_cast<int>(loops.joints.size()); }
  int n_couplings() const { return static_cast<int>(couplings.size()); }
  /// Do loops or couplings tie the tree's coordinates to each other?
  bool is_constrained() const { return n_loops() > 0 || n_couplings() > 0; }
  /// Rows of joint loads: the joints of the tree, then those that close loops.
  int n_loads() const { return n_joints() + n_loops(); }
  double total_mass() const { return total_mass_; }
  /// Index of a joint or throws InputError with the nearest names.
  int joint_index(const std::string& name) const;
  /// The same among all joints, those that close loops behind those of the tree: the row of its
  /// load.
  int load_index(const std::string& name) const;
  /// Its q and v are places among the tree's coordinates, or among those of loop joints.
  const JointInfo& joint_at(int load) const {
    return load < n_joints() ? joints[load] : loops.joints[load - n_joints()].joint;
  }
  int link_index(const std::string& name) const;
  /// q at the zero position: zeros, quaternions (0, 0, 0, 1).
  std::vector<double> neutral_configuration() const;
  /// q where the machine starts: as its joints' specs say, else at the zero position.
  std::vector<double> initial_configuration() const;
  /// The tail of messages about an element of this model.
  std::string where() const { return source_of(spec_); }
  bool has_passive_forces() const { return has_passive_; }
  /// First body whose 6x6 inertia is singular (index), or -1; the constraint-force form needs none.
  int singular_body() const { return singular_body_; }
  /// What keeps accelerations from being determined, one line with its remedy, or "".
  const std::string& undetermined() const { return undetermined_; }
  std::string body_name(int body) const;
  /// Where a body hangs on several axes without mass between them: that they may line up, and the
  /// remedy. Otherwise "".
  std::string lined_up(int body) const;
  /// What the user said about a joint, axes normalised.
  const JointSpec& joint_spec(int joint) const { return spec_of(joints[joint]); }
  const JointSpec& spec_of(const JointInfo& joint) const {
    return joint_of(spec_, joint.spec, floating_joint_);
  }
  /// Index of the joint inboard of each joint, -1 at the ground.
  std::vector<int> joint_parents() const;

  std::vector<BodyTopology> topology;
  std::vector<BodyConstants<double>> constants;
  BodyKinds::Bodies other_bodies;  ///< that are not rigid
  /// Of all joints of the tree, then those that stand for coordinates of bodies.
  std::vector<Element> elements;
  std::vector<int> own_element;  ///< by body, its first one of these, -1: none; empty: no body's
  std::vector<KindRange> kind_ranges;
  std::vector<JointInfo> joints;
  std::vector<LinkInfo> links;
  LoopJoints loops;
  std::vector<Coupling> couplings;
  std::vector<Bearing> bearings;
  std::vector<Note> notes;
  /// One array of length nv for each property of dof_property_table.
  std::array<std::vector<double>, n_dof_properties> dof;
  const std::vector<double>& dof_values(DofProperty property) const {
    return dof[static_cast<int>(property)];
  }
  Vec3<double> gravity;
  int n_general = 0;

 private:
  ModelSpec spec_;
  JointSpec floating_joint_;
  int nq_ = 0, nv_ = 0;
  double total_mass_ = 0;
  bool has_passive_ = false;
  int singular_body_ = -1;
  std::string undetermined_;
  NameIndex joint_by_name_, link_by_name_;
};

/// Throws InputError where the model has loops or couplings: `who` takes none. Without a remedy it
/// is to remove them.
void refuse_loops(const Model& model, const std::string& who, const std::string& remedy = "");

/// Body n, of a kind with coordinates.
CoordinateBody coordinate_body(const Model& model, int n);

/// The bodies of a range, whose kind is known while compiling.
template <class B>
struct BodiesOfKind {
  const Model& model;
  LW_INLINE const B& operator[](int n) const {
    return body_of_kind<B>(model.topology[n], model.constants[n], model.other_bodies);
  }
};

template <>
struct BodiesOfKind<CoordinateBody> {
  const Model& model;
  CoordinateBody operator[](int n) const { return coordinate_body(model, n); }
};

/// f(body n). Loops that count dispatch once per range instead (kinematics/kind_ranges.hpp).
template <class F>
LW_INLINE decltype(auto) with_body(const Model& model, int n, F&& f) {
  return BodyKinds::dispatch_seen(model.topology[n].body_kind, [&](auto kind) -> decltype(auto) {
    return f(BodiesOfKind<typename decltype(kind)::Body>{model}[n]);
  });
}

}  // namespace linkwise
