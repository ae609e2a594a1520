#include "linkwise/model/model.hpp"

#include <algorithm>

#include "linkwise/base/error.hpp"
#include "linkwise/model/hinge_frames.hpp"
#include "linkwise/model/place_bearings.hpp"
#include "linkwise/model/place_couplings.hpp"
#include "linkwise/model/place_loops.hpp"
#include "linkwise/model/undetermined.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

std::vector<KindRange> ranges_of(const std::vector<BodyTopology>& bodies) {
  std::vector<KindRange> ranges;
  for (size_t b = 0; b < bodies.size(); ++b)
    append_to_ranges(ranges, bodies[b], static_cast<int>(b));
  return ranges;
}

NameIndex index_joints(const std::vector<JointInfo>& joints) {
  NameIndex names;
  names.reset(joints.size());
  for (size_t i = 0; i < joints.size(); ++i)
    names.insert(
        static_cast<int>(i), [&](int k) -> const auto& { return joints[k].name; });
  return names;
}

}  // namespace

Model::Model(ModelSpec given) : spec_(std::move(given)) {
  validate(spec_, notes);
  link_by_name_ = index_links(spec_, where());
  const Machine machine = make_machine(spec_, link_by_name_, where());
  const SpanningForest forest = make_spanning_forest(machine.graph);
  const Lumps lumps = make_lumps(machine.graph, forest);
  check_forest(machine, forest, lumps);
  const LumpedInertia lumped = lump_inertia(machine, lumps, notes);
  const BodyTree tree = stack_massless(machine.graph, forest, lumps);
  PlacedJoints placed = place_joints(machine, lumps, lumped, tree);
  Bodies bodies = make_bodies(machine, lumped, tree, placed, notes);
  undetermined_ = find_undetermined(machine, lumps, lumped, notes);
  choose_hinge_frames(bodies, placed);
  links = place_links(machine, lumps, lumped, placed);
  loops = place_loops(machine, forest, placed.joints, links);
  note_loops(machine, forest, notes);

  notes.insert(notes.end(), spec_.notes.begin(), spec_.notes.end());
  gravity = spec_.gravity;
  total_mass_ = lumped.moving_mass;
  nq_ = placed.nq;
  nv_ = placed.nv;
  floating_joint_ = machine.floating_joint;
  n_general = bodies.n_general;
  singular_body_ = bodies.singular;
  topology = std::move(bodies.topology);
  constants = std::move(bodies.constants);
  other_bodies = std::move(bodies.others);
  own_element = std::move(bodies.own_element);
  kind_ranges = ranges_of(topology);
  elements = std::move(placed.elements);
  joints = std::move(placed.joints);
  dof = std::move(placed.dof);
  joint_by_name_ = index_joints(joints);
  for (DofProperty p : {DofProperty::damping, DofProperty::friction, DofProperty::stiffness,
                        DofProperty::limit_stiffness})
    has_passive_ |=
        std::any_of(dof_values(p).begin(), dof_values(p).end(), [](double x) { return x > 0; });
  for (const std::string& name : spec_.prescribed) load_index(name);
  couplings = place_couplings(*this);
  bearings = place_bearings(*this, notes);
}

int Model::load_index(const std::string& name) const {
  for (int l = 0; l < n_loops(); ++l)
    if (loops.joints[l].joint.name == name) return n_joints() + l;
  return joint_index(name);
}

int Model::joint_index(const std::string& name) const {
  const int found = joint_by_name_.find(
      name, [this](int i) -> const auto& { return joints[i].name; });
  if (found >= 0) return found;
  for (const JointSpec& j : spec_.joints)
    if (j.name == name && j.type == JointType::fixed)
      throw InputError(
          "joint '" + name + "'" + where() + " is fixed and its links are merged" +
          (spec_.keep_fixed
               ? ", because nothing on it has mass; its load is in lw.loads.in_frame"
               : "; its load is in lw.loads.in_frame (linkwise loads --at child -j), or load with "
                 "keep_fixed (keep_fixed = true in a scenario)"));
  std::vector<std::string> known;
  for (const auto& j : joints) known.push_back(j.name);
  for (const auto& loop : loops.joints) {
    if (loop.joint.name == name)
      throw InputError("joint '" + name + "'" + where() +
                       " closes a loop: its motion follows from that of the other joints");
    known.push_back(loop.joint.name);
  }
  throw InputError("joint '" + name + "' does not exist in model '" + spec_.name + "'" + where() +
                   suggest(name, known));
}

int Model::link_index(const std::string& name) const {
  const int found = link_by_name_.find(
      name, [this](int i) -> const auto& { return links[i].name; });
  if (found >= 0) return found;
  std::vector<std::string> known;
  for (const auto& l : links) known.push_back(l.name);
  throw InputError("link '" + name + "' does not exist in model '" + spec_.name + "'" + where() +
                   suggest(name, known));
}

std::vector<double> Model::neutral_configuration() const {
  std::vector<double> q(nq_, 0.0);
  for (const Element& e : elements)
    if (const int own = info_of(e.kind).quaternion; own >= 0) q[e.q + own + 3] = 1;
  return q;
}

std::vector<double> Model::initial_configuration() const {
  std::vector<double> q = neutral_configuration();
  for (int j = 0; j < n_joints(); ++j) {
    const std::vector<double>& initial = joint_spec(j).initial;
    std::copy(initial.begin(), initial.end(), q.begin() + joints[j].q);
  }
  return q;
}

std::string Model::body_name(int body) const {
  for (const JointInfo& j : joints)
    if (j.body == body && j.last_of_body) return links[j.link].name;
  return "?";
}

std::string Model::lined_up(int body) const {
  if (topology[body].nv < 2) return "";
  std::string in_line, massless;
  int count = 0, sliding = 0;
  for (const JointInfo& j : joints) {
    if (j.body != body) continue;
    in_line += (count++ ? ", '" : "'") + j.name + "'";
    if (!j.last_of_body) massless += (massless.empty() ? "'" : ", '") + links[j.link].name + "'";
    for (int k = 0; k < j.n_elements; ++k)
      sliding += elements[j.first_element + k].kind == ElementKind::prismatic;
  }
  if (count < 2) return "";
  const char* instead = "leave one of the joints out";
  if (sliding == 0 && topology[body].nv == 3) instead = "make one spherical joint of the joints";
  if (sliding > 0 && topology[body].nv == 6) instead = "make one floating joint of the joints";
  return (sliding ? "some of joints " : "joints ") + in_line +
         " line up here (gimbal lock) and links " + massless +
         " between them have no mass: give those links mass and inertia or the joints armature, "
         "keep away from this position, or " +
         instead;
}

std::vector<int> Model::joint_parents() const {
  std::vector<int> parents;
  parents.reserve(joints.size());
  for (const JointInfo& j : joints) {
    const BodyTopology& body = topology[j.body];
    int before = j.first_element - 1;  // the element inboard of the joint's
    if (j.first_element == body.first_element) {
      const BodyTopology* p = body.parent >= 0 ? &topology[body.parent] : nullptr;
      before = p ? p->first_element + p->n_elements - 1 : -1;
    }
    parents.push_back(before < 0 ? -1 : elements[before].joint);
  }
  return parents;
}

CoordinateBody coordinate_body(const Model& model, int n) {
  const BodyTopology& at = model.topology[n];
  return BodyKinds::dispatch(at.body_kind, [&](auto kind) {
    using B = typename decltype(kind)::Body;
    if constexpr (has_coordinates<B>)
      return CoordinateBody(at.body_kind, &BodiesOfKind<B>{model}[n]);
    else
      return CoordinateBody();
  });
}

void refuse_loops(const Model& model, const std::string& who, const std::string& remedy) {
  if (!model.is_constrained()) return;
  const bool loop = model.n_loops() > 0;
  throw InputError("model '" + model.spec().name + "'" + model.where() + ": " +
                   (loop ? "joint '" + model.loops.joints.front().joint.name + "' closes a loop"
                         : "coupling '" + model.couplings.front().name + "' ties joints together") +
                   ", and " + who + " takes none; " +
                   (!remedy.empty() ? remedy
                    : loop          ? "remove a joint of the loop"
                                    : "remove the coupling"));
}

}  // namespace linkwise
