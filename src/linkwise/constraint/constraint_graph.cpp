#include "linkwise/constraint/constraint_graph.hpp"

#include <algorithm>
#include <vector>

#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/kinematics/own_states.hpp"
#include "linkwise/model/lumped_inertia.hpp"

namespace linkwise {
namespace {

bool is_elastic(const Model& model, int body) {
  return !model.own_element.empty() && model.own_element[body] >= 0;
}

int hub_of(const Model& model, int body) {
  return body >= 0 && is_massless_on_port(model, body) ? model.topology[body].parent : body;
}

}  // namespace

int column_of(const Model& model, const Coupling::Term& term) {
  if (term.closes) {
    const JointInfo& joint = model.joint_at(term.joint);
    return model.loops.elements[joint.first_element].prescribed ? -1 : 0;
  }
  const BodyTopology& body = model.topology[term.body];
  int column = 0;
  for (int i = 0; i < body.n_elements; ++i) {
    const Element& e = model.elements[body.first_element + i];
    if (e.prescribed) continue;
    if (e.v == term.v) return column;
    column += e.nv;
  }
  return -1;
}

const LoopJoint& loop_of(const Model& model, const Coupling::Term& term) {
  return model.loops.joints[term.joint - model.n_joints()];
}

bool is_massless_on_port(const Model& model, int n) {
  const BodyTopology& body = model.topology[n];
  return body.body_kind == BodyKind::rigid && on_port(model, body) &&
         model.constants[n].rigid.inertia.m == 0;
}

BlockGraph make_constraint_graph(const Model& model) {
  std::vector<int> dims;
  std::vector<std::vector<int>> hubs;
  std::vector<char> is_wide(model.n_bodies());
  const auto node = [&](int rows) {
    dims.push_back(rows);
    hubs.push_back({});
  };
  const auto end_on = [&](int body) {
    const int hub = hub_of(model, body);
    if (hub >= 0 && std::find(hubs.back().begin(), hubs.back().end(), hub) == hubs.back().end())
      hubs.back().push_back(hub);
  };
  for (int n = 0; n < model.n_bodies(); ++n) {
    is_wide[n] = is_elastic(model, n);
    const bool is_port = is_massless_on_port(model, n);
    node(is_port ? 0 : constraint_rows(model, n));
    if (is_port) continue;
    end_on(n);
    end_on(model.topology[n].parent);
  }
  for (const LoopJoint& loop : model.loops.joints) {
    node(loop_rows(model, loop));
    end_on(loop.joint.body);
    end_on(loop.parent_body);
  }
  for (const Coupling& coupling : model.couplings) {
    node(1);
    for (const Coupling::Term& term : coupling.terms) {
      if (column_of(model, term) < 0) continue;
      end_on(term.body);
      end_on(term.closes ? loop_of(model, term).parent_body : model.topology[term.body].parent);
    }
  }
  BlockGraph graph;
  graph.set_structure(dims, hubs, is_wide);
  return graph;
}

std::string refusal_of_graph(const Model& model) {
  for (int n = std::max(model.singular_body(), 0); n < model.n_bodies(); ++n) {
    if (model.singular_body() < 0) break;
    if (is_singular(model.constants[n].rigid.inertia) && !is_elastic(model, n) &&
        !is_massless_on_port(model, n))
      return singular_inertia(model, n);
  }
  for (const LoopJoint& loop : model.loops.joints)
    if (loop.parent_body == loop.joint.body)
      return "joint '" + loop.joint.name + "'" + model.where() +
             " joins links that move as one, which method constraint_force does not take; remove "
             "it, or use method articulated_body";
  return "";
}

}  // namespace linkwise
