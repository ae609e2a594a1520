#include "linkwise/model/model.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

#include "linkwise/base/error.hpp"
#include "linkwise/model/hinge_frames.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

using Xform = Transform<double>;

/// The smallest rotation that takes z to the unit vector a, as a matrix whose columns are the
/// turned axes; a half turn about x first when a points down, so that it never degenerates.
Mat3<double> align_z(Vec3<double> a) {
  const bool down = a.z < 0;
  if (down) a = {a.x, -a.y, -a.z};
  const double k = 1 / (1 + a.z);
  Mat3<double> R{{1 - a.x * a.x * k, -a.x * a.y * k, a.x, -a.x * a.y * k, 1 - a.y * a.y * k, a.y,
                  -a.x, -a.y, a.z}};
  if (down)
    for (int j = 3; j < 9; ++j) R.m[j] = -R.m[j];
  return R;
}

/// Inertia about a frame's origin from mass, centre and central inertia: I + m (c.c 1 - c c^T).
Inertia<double> about_origin(const LinkSpec& link) {
  const auto& c = link.com;
  const double m = link.mass;
  Inertia<double> out{m, m * c, link.inertia};
  out.I.m[0] += m * (c.y * c.y + c.z * c.z);
  out.I.m[1] -= m * c.x * c.y;
  out.I.m[2] += m * (c.x * c.x + c.z * c.z);
  out.I.m[3] -= m * c.x * c.z;
  out.I.m[4] -= m * c.y * c.z;
  out.I.m[5] += m * (c.x * c.x + c.y * c.y);
  return out;
}

/// Inertia of the child frame X = (parent -> child), seen at the parent.
Inertia<double> to_parent(const Xform& X, const Inertia<double>& M) {
  ArticulatedInertia<double> Y;
  add_inertia(Y, M);
  const ArticulatedInertia<double> Z = transform_to_parent(X, Y);
  return {M.m, transpose_times(X.R, M.mc) + M.m * X.r, Z.C};
}

void add(Inertia<double>& a, const Inertia<double>& b) {
  a.m += b.m;
  a.mc += b.mc;
  for (int i = 0; i < 6; ++i) a.I.m[i] += b.I.m[i];
}

bool massless(const Inertia<double>& M) {
  return M.m == 0 && std::all_of(M.I.m, M.I.m + 6, [](double x) { return x == 0; });
}

/// Inertia about the centre of mass; M.m > 0.
Sym3<double> central(const Inertia<double>& M) {
  const auto c = (1 / M.m) * M.mc;
  Sym3<double> out = M.I;
  const double m = M.m;
  out.m[0] -= m * (c.y * c.y + c.z * c.z);
  out.m[1] += m * c.x * c.y;
  out.m[2] -= m * (c.x * c.x + c.z * c.z);
  out.m[3] += m * c.x * c.z;
  out.m[4] += m * c.y * c.z;
  out.m[5] -= m * (c.x * c.x + c.y * c.y);
  return out;
}

/// Singular as a 6x6 matrix: no mass, or no rotational inertia about some axis through the centre.
bool singular(const Inertia<double>& M) {
  if (!(M.m > 0)) return true;
  double principal[3], whole[3];
  principal_moments(central(M), principal);
  principal_moments(M.I, whole);
  return principal[0] <= 1e-12 * whole[2];
}

ElementKind element_kind(AxisKind kind) {
  return kind == AxisKind::revolute    ? ElementKind::revolute
         : kind == AxisKind::prismatic ? ElementKind::prismatic
                                       : ElementKind::helical;
}

/// The elements of a joint, axis by axis; a revolute one for a revolute joint, two for a universal
/// one.
std::vector<AxisSpec> stack_of(const JointSpec& j) {
  std::vector<AxisSpec> axes = j.axes;
  switch (j.type) {
    case JointType::revolute:
    case JointType::continuous:
      axes[0].kind = AxisKind::revolute;
      break;
    case JointType::prismatic:
      axes[0].kind = AxisKind::prismatic;
      break;
    case JointType::helical:
      axes[0].kind = AxisKind::helical;
      break;
    case JointType::cylindrical:
      axes = {{AxisKind::prismatic, axes[0].axis, 0}, {AxisKind::revolute, axes[0].axis, 0}};
      break;
    case JointType::universal:
      axes[0].kind = axes[1].kind = AxisKind::revolute;
      break;
    default:
      break;
  }
  return axes;
}

}  // namespace

/// Turns a ModelSpec into a Model step by step; lives only while one is built.
class ModelAssembly {
 public:
  explicit ModelAssembly(Model& model) : m(model), spec(model.spec_), where(model.where()) {}

  void run() {
    check_links();
    check_joints();
    add_floating_base();
    order_joints();
    weld();
    stack_massless();
    place_joints();
    make_bodies();
    choose_hinge_frames(m);
    make_runs();
    m.notes.insert(m.notes.end(), spec.notes.begin(), spec.notes.end());
  }

 private:
  Model& m;
  ModelSpec& spec;
  std::string where;
  int root = -1;
  std::vector<int> parent_link, child_link;  // by spec joint
  std::vector<int> inboard;                  // by link: spec joint, -1 root
  std::vector<int> order;                    // spec joints, parents first, file order otherwise
  std::vector<char> welded;                  // by spec joint
  std::vector<int> lead;                     // by link: the link it is welded to
  std::vector<Xform> from_lead;              // by link: lead frame -> link frame
  std::vector<Inertia<double>> lumped;       // by link, of leads
  std::vector<int> moving_children;          // by link, of leads
  std::vector<char> stacked;                 // by link: massless, part of its child's stack
  std::vector<int> joint_of;                 // by link: model joint, -1
  std::vector<int> model_joint;              // by spec joint

  [[noreturn]] void fail(const std::string& text) const { throw InputError(text); }

  void check_links() {
    if (spec.links.empty())
      fail("model '" + spec.name + "'" + where + " has no links; add at least one");
    if (!std::isfinite(spec.gravity.x) || !std::isfinite(spec.gravity.y) ||
        !std::isfinite(spec.gravity.z))
      fail("model '" + spec.name + "'" + where +
           ": gravity is not finite; give three finite numbers in m/s2");
    const auto link_name = [this](int i) -> const auto& { return spec.links[i].name; };
    m.link_by_name_.reset(spec.links.size());
    for (size_t i = 0; i < spec.links.size(); ++i) {
      validate_link(spec.links[i], where, m.notes);
      if (!m.link_by_name_.insert(static_cast<int>(i), link_name))
        fail("link '" + spec.links[i].name + "'" + where +
             ": the name is used twice; rename one of them");
    }
  }

  int find_link(const std::string& name, const JointSpec& joint, const char* role) const {
    const int found = m.link_by_name_.find(
        name, [this](int i) -> const auto& { return spec.links[i].name; });
    if (found >= 0) return found;
    std::vector<std::string> known;
    for (const auto& l : spec.links) known.push_back(l.name);
    fail("joint '" + joint.name + "'" + where + ": " + role + " link '" + name +
         "' does not exist" + suggest(name, known));
  }

  void check_joints() {
    const int n_links = static_cast<int>(spec.links.size());
    inboard.assign(n_links, -1);
    const auto joint_name = [this](int i) -> const auto& { return spec.joints[i].name; };
    NameIndex names;
    names.reset(spec.joints.size());
    for (size_t i = 0; i < spec.joints.size(); ++i) {
      JointSpec& j = spec.joints[i];
      validate_joint(j, where);
      if (!names.insert(static_cast<int>(i), joint_name))
        fail("joint '" + j.name + "'" + where + ": the name is used twice; rename one of them");
      parent_link.push_back(find_link(j.parent, j, "parent"));
      child_link.push_back(find_link(j.child, j, "child"));
      int& in = inboard[child_link.back()];
      if (in >= 0)
        fail("link '" + j.child + "'" + where + " is the child of two joints, '" +
             spec.joints[in].name + "' and '" + j.name +
             "'; a tree link has one parent: remove one joint");
      in = static_cast<int>(i);
    }
    for (int l = 0; l < n_links; ++l) {
      if (inboard[l] >= 0) continue;
      if (root >= 0)
        fail("links '" + spec.links[root].name + "' and '" + spec.links[l].name + "'" + where +
             " both have no parent; a model has one root: join them with a joint");
      root = l;
    }
    if (root < 0)
      fail("model '" + spec.name + "'" + where + ": every link has a parent, so link '" +
           spec.links[0].name + "' is on a cycle; remove the joint that closes it");
  }

  void add_floating_base() {
    if (!spec.floating_base) return;
    for (const auto& j : spec.joints)
      if (j.name == spec.floating_joint)
        fail("joint '" + j.name + "'" + where +
             ": the floating base needs this name; rename the joint");
    JointSpec free_joint;
    free_joint.name = spec.floating_joint;
    free_joint.type = JointType::floating;
    free_joint.child = spec.links[root].name;
    base_ = std::move(free_joint);
  }
  JointSpec base_;

  // Spec joint index -1 stands for the floating base's joint.
  const JointSpec& joint_spec(int j) const { return j < 0 ? base_ : spec.joints[j]; }
  int child_of(int j) const { return j < 0 ? root : child_link[j]; }

  void order_joints() {
    const int n = static_cast<int>(spec.joints.size());
    std::vector<int> first(spec.links.size(), -1), next(n, -1);
    for (int j = n - 1; j >= 0; --j) {
      next[j] = first[parent_link[j]];
      first[parent_link[j]] = j;
    }
    std::priority_queue<int, std::vector<int>, std::greater<int>> ready;
    for (int j = first[root]; j >= 0; j = next[j]) ready.push(j);
    while (!ready.empty()) {
      const int j = ready.top();
      ready.pop();
      order.push_back(j);
      for (int k = first[child_link[j]]; k >= 0; k = next[k]) ready.push(k);
    }
    if (static_cast<int>(order.size()) == n) return;
    std::vector<char> reached(n, 0);
    for (int j : order) reached[j] = 1;
    for (int j = 0; j < n; ++j)
      if (!reached[j])
        fail("joint '" + spec.joints[j].name + "'" + where + ": link '" + spec.joints[j].child +
             "' is on a cycle that the root '" + spec.links[root].name +
             "' does not reach; remove the joint that closes it");
  }

  void weld() {
    const int n_links = static_cast<int>(spec.links.size());
    lead.resize(n_links);
    from_lead.assign(n_links, Xform{Mat3<double>::identity(), {}});
    welded.assign(spec.joints.size(), 0);
    for (int l = 0; l < n_links; ++l) {
      lead[l] = l;
      lumped.push_back(about_origin(spec.links[l]));
      m.total_mass_ += spec.links[l].mass;
    }
    for (int j : order) {
      const JointSpec& s = spec.joints[j];
      const int c = child_link[j], p = parent_link[j];
      if (s.type != JointType::fixed || (spec.keep_fixed && spec.links[c].mass > 0)) continue;
      welded[j] = 1;
      lead[c] = lead[p];
      from_lead[c] = Xform{transpose(s.rotation), s.translation} * from_lead[p];
      add(lumped[lead[c]], to_parent(from_lead[c], about_origin(spec.links[c])));
      m.notes.push_back(
          {NoteLevel::merge, spec.links[c].name,
           "welded to '" + spec.links[lead[c]].name + "' by fixed joint '" + s.name + "'"});
    }
    moving_children.assign(n_links, 0);
    for (int j : order)
      if (!welded[j]) ++moving_children[lead[parent_link[j]]];
    if (!spec.floating_base) m.total_mass_ -= lumped[root].m;
    for (int l = 0; l < n_links; ++l) check_inertia(l);
  }

  /// A clearly negative principal moment is an error, except on a welded link where the sum with
  /// what it is welded to is a possible inertia: robots in use carry such antennas and sensors.
  void check_inertia(int l) {
    const LinkSpec& link = spec.links[l];
    double principal[3];
    principal_moments(link.inertia, principal);
    if (!clearly_negative(link.mass, principal)) return;
    const Inertia<double>& sum = lumped[lead[l]];
    if (lead[l] != l && sum.m > 0) {
      double of_sum[3];
      principal_moments(central(sum), of_sum);
      if (!clearly_negative(sum.m, of_sum)) {
        m.notes.push_back({NoteLevel::warning, link.name,
                           "inertia has a negative principal moment: no real body has it"});
        return;
      }
    }
    fail("link '" + link.name + "'" + where + ": inertia has a negative principal moment (" +
         std::to_string(principal[0]) +
         " kg m2); give a positive semidefinite inertia about the centre of mass");
  }

  /// Massless leads: one moving child -> part of its stack; none -> error; several -> kept,
  /// recursion only.
  void stack_massless() {
    stacked.assign(spec.links.size(), 0);
    const auto consider = [&](int j) {
      const int l = child_of(j);
      if (!massless(lumped[l])) return;
      const std::string head = "link '" + spec.links[l].name + "'" + where;
      if (moving_children[l] == 0)
        fail(head + " has no mass and is a leaf, but joint '" + joint_spec(j).name +
             "' can move it; give it a mass and an inertia, or make the joint fixed");
      if (moving_children[l] == 1)
        stacked[l] = 1;
      else
        m.notes.push_back({NoteLevel::warning, spec.links[l].name,
                           "has no mass and carries several joints; method constraint_force cannot "
                           "take it, articulated_body can"});
    };
    if (spec.floating_base) consider(-1);
    for (int j : order)
      if (!welded[j]) consider(j);
  }

  void place_joints() {
    joint_of.assign(spec.links.size(), -1);
    model_joint.assign(spec.joints.size(), -1);
    if (spec.floating_base) add_joint(-1);
    for (int j : order)
      if (!welded[j]) add_joint(j);
    m.joint_by_name_.reset(m.joints.size());
    for (int i = 0; i < m.n_joints(); ++i)
      m.joint_by_name_.insert(
          i, [this](int k) -> const auto& { return m.joints[k].name; });
    for (size_t l = 0; l < spec.links.size(); ++l)
      m.links.push_back({spec.links[l].name, joint_of[lead[l]], from_lead[l]});
  }

  void add_joint(int j) {
    const JointSpec& s = joint_spec(j);
    JointInfo info;
    info.name = s.name;
    info.type = s.type;
    info.link = child_of(j);
    info.q = m.nq_;
    info.v = m.nv_;
    info.nv = joint_dof(s);
    info.nq = info.nv + (s.type == JointType::spherical || s.type == JointType::floating);
    append_dof_properties(s, where, m.dof);
    m.nq_ += info.nq;
    m.nv_ += info.nv;
    joint_of[info.link] = m.n_joints();
    if (j >= 0) model_joint[j] = m.n_joints();
    m.joints.push_back(std::move(info));
  }

  /// Bodies in the order of the joints that carry mass; each takes the stack of joints inboard of
  /// it.
  void make_bodies() {
    std::vector<int> body_of_link(spec.links.size(), -1);
    for (int jm = 0; jm < m.n_joints(); ++jm) {
      const int link = m.joints[jm].link;
      if (stacked[link]) continue;
      std::vector<int> chain{jm};  // outboard to inboard
      int l = link;
      for (;;) {
        const int sj = inboard[l];
        const int p = sj < 0 ? -1 : lead[parent_link[sj]];
        if (p < 0 || !stacked[p]) break;
        chain.push_back(joint_of[p]);
        l = p;
      }
      const int sj = inboard[l];
      const int parent = sj < 0 ? -1 : body_of_link[lead[parent_link[sj]]];
      std::reverse(chain.begin(), chain.end());
      body_of_link[link] = make_body(chain, parent, link);
    }
  }

  int make_body(const std::vector<int>& chain, int parent, int link) {
    const int index = m.n_bodies();
    BodyTopology body;
    body.parent = parent;
    body.first_element = static_cast<int>(m.elements.size());
    BodyConstants<double> constants;
    for (int jm : chain) {
      JointInfo& info = m.joints[jm];
      info.body = index;
      info.last_of_body = jm == chain.back();
      body.nv += info.nv;
      add_elements(info, constants.tree);
    }
    if (body.nv > 6) {
      std::string names;
      for (size_t i = 0; i + 1 < chain.size(); ++i)
        names += (i ? "', '" : "'") + spec.links[m.joints[chain[i]].link].name;
      fail("links " + names + "'" + where + " have no mass and leave " + std::to_string(body.nv) +
           " degrees of freedom between '" + spec.links[link].name +
           "' and the next inboard mass (6 at most); give one of them a mass and an inertia");
    }
    for (size_t i = 0; i + 1 < chain.size(); ++i)
      m.notes.push_back({NoteLevel::merge, spec.links[m.joints[chain[i]].link].name,
                         "has no mass: joint '" + m.joints[chain[i]].name + "' is stacked with '" +
                             m.joints[chain[i + 1]].name + "'"});
    const JointInfo& last = m.joints[chain.back()];
    body.n_elements = static_cast<int>(m.elements.size()) - body.first_element;
    // From the link's axes to the body frame's.
    constants.inertia = to_parent(last.to_user, lumped[link]);
    classify(body, constants);
    if (singular(lumped[link]) && m.singular_body_ < 0) m.singular_body_ = index;
    if (parent >= 0) ++m.topology[parent].n_children;
    m.topology.push_back(body);
    m.constants.push_back(constants);
    return index;
  }

  void classify(BodyTopology& body, BodyConstants<double>& constants) {
    body.kind = BodyKind::general;
    if (body.n_elements == 1) {
      const Element& e = m.elements[body.first_element];
      body.q = e.q;
      body.v = e.v;
      body.nq = e.nq;
      if (!e.prescribed && e.nv == 1) {
        body.kind = e.kind == ElementKind::revolute    ? BodyKind::revolute
                    : e.kind == ElementKind::prismatic ? BodyKind::prismatic
                                                       : BodyKind::helical;
        constants.pitch = e.pitch;
        constants.armature = m.dof_values(DofProperty::armature)[e.v];
        if (body.kind == BodyKind::revolute && constants.armature > 0) body.kind = BodyKind::geared;
      }
    }
    if (body.kind == BodyKind::general) body.general = m.n_general++;
  }

  /// The joint's elements, placed after the frame of the previous one (or of the parent link's
  /// joint).
  void add_elements(JointInfo& info, Xform& tree) {
    const int sj = inboard[info.link];
    Xform to_joint{Mat3<double>::identity(),
                   {}};  // previous internal frame -> user joint frame at zero
    const JointSpec& s = joint_spec(sj);
    if (sj >= 0) {
      const int pl = parent_link[sj], pj = joint_of[lead[pl]];
      to_joint = Xform{transpose(s.rotation), s.translation} * from_lead[pl];
      if (pj >= 0) to_joint = to_joint * m.joints[pj].to_user;
    }
    info.to_user = {Mat3<double>::identity(), {}};
    info.first_element = static_cast<int>(m.elements.size());
    Element e;
    e.q = info.q;
    e.v = info.v;
    e.joint = static_cast<int>(&info - m.joints.data());
    e.prescribed =
        std::find(spec.prescribed.begin(), spec.prescribed.end(), s.name) != spec.prescribed.end();
    const auto push = [&](ElementKind kind, int nq, int nv, const Mat3<double>& A, double pitch) {
      e.kind = kind;
      e.nq = nq;
      e.nv = nv;
      e.pitch = pitch;
      e.placement = Xform{transpose(A), {}} * to_joint;
      m.elements.push_back(e);
      e.q += nq;
      e.v += nv;
      to_joint =
          Xform{A, {}};  // the next element starts from this frame, turned back to the user's axes
      info.to_user = {A, {}};
      tree = e.placement;
    };
    if (s.type == JointType::fixed)
      push(ElementKind::fixed, 0, 0, Mat3<double>::identity(), 0);
    else if (s.type == JointType::spherical)
      push(ElementKind::spherical, 4, 3, Mat3<double>::identity(), 0);
    else if (s.type == JointType::floating)
      push(ElementKind::floating, 7, 6, Mat3<double>::identity(), 0);
    else if (s.type == JointType::planar)
      push(ElementKind::planar, 3, 3, align_z(s.axes[0].axis), 0);
    else
      for (const AxisSpec& a : stack_of(s))
        push(element_kind(a.kind), 1, 1, align_z(a.axis), a.pitch);
    info.n_elements = static_cast<int>(m.elements.size()) - info.first_element;
  }

  void make_runs() {
    for (int b = 0; b < m.n_bodies(); ++b) append_to_ranges(m.kind_ranges, m.topology[b].kind, b);
    std::vector<char> met(m.n_bodies(), 0);
    for (int b = m.n_bodies() - 1; b >= 0; --b) {
      const int p = m.topology[b].parent;
      m.topology[b].first_to_give = p >= 0 && !met[p];
      if (p >= 0) met[p] = 1;
    }
    const auto any = [&](DofProperty p) {
      const auto& values = m.dof_values(p);
      return std::any_of(values.begin(), values.end(), [](double x) { return x > 0; });
    };
    m.has_passive_ = any(DofProperty::damping) || any(DofProperty::friction) ||
                     any(DofProperty::stiffness) || any(DofProperty::limit_stiffness);
    m.gravity = spec.gravity;
    for (const std::string& name : spec.prescribed) m.joint_index(name);
  }
};

Model::Model(ModelSpec spec) : spec_(std::move(spec)) { ModelAssembly(*this).run(); }

int Model::joint_index(const std::string& name) const {
  const int found = joint_by_name_.find(
      name, [this](int i) -> const auto& { return joints[i].name; });
  if (found >= 0) return found;
  std::vector<std::string> known;
  for (const auto& j : joints) known.push_back(j.name);
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
    if (e.kind == ElementKind::spherical || e.kind == ElementKind::floating) q[e.q + e.nq - 1] = 1;
  return q;
}

std::string Model::body_name(int body) const {
  for (const JointInfo& j : joints)
    if (j.body == body && j.last_of_body) return links[j.link].name;
  return "?";
}

}  // namespace linkwise
