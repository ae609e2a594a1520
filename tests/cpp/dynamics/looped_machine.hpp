#pragma once
// A tree with loops closed at a given position by joints of any type, and states that keep them
// closed.
#include <string>
#include <vector>

#include "kinematics/world_twin.hpp"
#include "linkwise/kinematics/loop_states.hpp"
#include "linkwise/linear/semidefinite.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {

/// The elements of a joint as a model places them, its axis in any direction.
inline std::vector<Element> random_stack(JointType type, Draws& draws) {
  if (type == JointType::fixed) {
    Element weld;
    weld.kind = ElementKind::fixed;
    weld.nq = weld.nv = 0;
    weld.placement = {random_rotation(draws), random_vector3(draws)};
    return {weld};
  }
  ModelSpec spec = tree_spec({type}, {-1}, draws);
  spec.joints[0].axes.resize(type == JointType::universal ? 2 : 1);
  return Model(spec).elements;
}

inline Transform<double> stack_pose(std::span<const Element> stack, const double* q) {
  Transform<double> X = element_pose(stack[0], q);
  for (size_t i = 1; i < stack.size(); ++i) X = element_pose(stack[i], q) * X;
  return X;
}

/// World -> frame of each body.
inline std::vector<Transform<double>> body_poses(const Model& tree, const double* q) {
  std::vector<Transform<double>> X(tree.n_bodies());
  for (int n = 0; n < tree.n_bodies(); ++n) {
    const BodyTopology& at = tree.topology[n];
    X[n] = stack_pose(std::span(tree.elements).subspan(at.first_element, at.n_elements), q);
    if (at.parent >= 0) X[n] = X[n] * X[at.parent];
  }
  return X;
}

inline Transform<double> inverse(const Transform<double>& X) {
  return {transpose(X.R), -(X.R * X.r)};
}

/// n four-bars side by side on the ground, in a plane: unit rods stand on pins at (i, 0), and a bar
/// leads from each tip to the next.
inline ModelSpec row_of_four_bars(int n) {
  ModelSpec spec;
  spec.gravity = {0.3, -9.81, 0};
  spec.links.push_back({"base", 0, {}, {}});
  const auto hinge = [&](std::string name, std::string parent, std::string child,
                         const Vec3<double>& at) {
    JointSpec joint;
    joint.name = std::move(name);
    joint.parent = std::move(parent);
    joint.child = std::move(child);
    joint.translation = at;
    joint.axes = {{AxisKind::revolute, {0, 0, 1}, 0}};
    return joint;
  };
  for (int i = 0; i <= n; ++i) {
    const std::string k = std::to_string(i), next = std::to_string(i + 1);
    const double x = i;
    spec.links.push_back({"rod" + k, 1, {0, 0.5, 0}, {{0.1, 0, 0.01, 0, 0, 0.1}}});
    spec.joints.push_back(hinge("pin" + k, "base", "rod" + k, {x, 0, 0}));
    if (i == n) break;
    spec.links.push_back({"bar" + k, 1, {0.5, 0, 0}, {{0.01, 0, 0.1, 0, 0, 0.1}}});
    spec.joints.push_back(hinge("left" + k, "rod" + k, "bar" + k, {0, 1, 0}));
    LoopJointSpec loop;
    loop.joint = hinge("right" + k, "bar" + k, "rod" + next, {1, 0, 0});
    loop.child_translation = {0, 1, 0};
    spec.loop_joints.push_back(loop);
  }
  return spec;
}

/// A wheel whose axle has a second bearing, so that the loop joint's angle is the wheel's.
inline ModelSpec wheel_on_two_bearings(double damping = 0) {
  ModelSpec spec;
  spec.links.push_back({"base", 0, {}, {}});
  spec.links.push_back({"wheel", 1, {}, {{1, 0, 1, 0, 0, 2}}});
  JointSpec joint;
  joint.parent = "base";
  joint.child = "wheel";
  joint.axes = {{AxisKind::revolute, {0, 0, 1}, 0}};
  joint.name = "axle";
  spec.joints.push_back(joint);
  joint.name = "bearing";
  joint.dof.push_back({DofProperty::damping, {damping}});
  LoopJointSpec loop;
  loop.joint = joint;
  spec.loop_joints.push_back(loop);
  return spec;
}

struct LoopedMachine {
  Model tree, model;  ///< without and with loops
  std::vector<double> q, v;
  std::vector<double> q_loops;            ///< of loop joints where they were closed
  std::vector<double> v_given, du_given;  ///< of loop joints of given motion, else 0

  LoopedMachine(const ModelSpec& spec, Draws& draws) : tree(spec), model(spec) {
    MachineState state = random_state(tree, draws);
    q = state.q;
    v = state.v;
  }

  /// With the loops of a spec, at the zero position.
  explicit LoopedMachine(const ModelSpec& spec)
      : tree([&] {
          ModelSpec open = spec;
          open.loop_joints.clear();
          return Model(open);
        }()),
        model(spec),
        q(tree.neutral_configuration()),
        v(tree.nv()) {}

  /// Joins bodies a and b (-1: ground) where they are.
  void close(JointType type, int a, int b, Draws& draws) {
    std::vector<Element> stack = random_stack(type, draws);
    LoopJoint loop;
    LoopJoints& loops = model.loops;
    JointInfo& joint = loop.joint;
    joint.name = "loop" + std::to_string(loops.joints.size());
    joint.type = type;
    joint.body = b;
    joint.first_element = static_cast<int>(loops.elements.size());
    joint.n_elements = static_cast<int>(stack.size());
    joint.q = loops.nq;
    joint.v = loops.nv;
    joint.to_user = {random_rotation(draws), random_vector3(draws)};
    loop.parent_body = a;
    loop.on_parent = {random_rotation(draws), random_vector3(draws)};
    for (Element& e : stack) {
      e.q = loops.nq;
      e.v = loops.nv;
      loops.nq += e.nq;
      loops.nv += e.nv;
      loops.elements.push_back(e);
      for (int i = 0; i < e.nq; ++i) q_loops.push_back(draws.uniform(-1, 1));
    }
    joint.nq = loops.nq - joint.q;
    joint.nv = loops.nv - joint.v;
    for (auto& values : loops.dof) values.resize(loops.nv);
    const auto poses = body_poses(tree, q.data());
    const auto at = [&](int body) {
      return body < 0 ? Transform<double>{Mat3<double>::identity(), {}} : poses[body];
    };
    loop.on_child = stack_pose(stack, q_loops.data()) * loop.on_parent * at(a) * inverse(at(b));
    loops.joints.push_back(loop);
  }
  /// A rod between random points of bodies a and b.
  void close_rod(int a, int b, Draws& draws) {
    close(JointType::fixed, a, b, draws);
    LoopJoint& loop = model.loops.joints.back();
    loop.on_child = {random_rotation(draws), random_vector3(draws)};
    const auto poses = body_poses(tree, q.data());
    const auto point = [&](int body, const Transform<double>& X) {
      return body < 0 ? X.r : (X * poses[body]).r;
    };
    const Vec3<double> r = point(b, loop.on_child) - point(a, loop.on_parent);
    loop.kind = LoopKind::rod;
    loop.length = std::sqrt(dot(r, r));
  }
  /// The last loop joint once more: a copy of it holds what it holds already.
  void close_again() {
    LoopJoint loop = model.loops.joints.back();
    loop.joint.name += "_again";
    model.loops.joints.push_back(loop);
  }

  /// From now on the motion of a loop joint is given: it goes on as it moves now, and faster.
  void prescribe(int l, Draws& draws) {
    LoopStates states(model);
    SweepInput<double> in = input();
    in.loop_q = q_loops.data();
    states.update(in);
    v_given.resize(model.loops.nv);
    du_given.resize(model.loops.nv);
    const JointInfo& joint = model.loops.joints[l].joint;
    for (int i = joint.v; i < joint.v + joint.nv; ++i) {
      v_given[i] = states.v()[i];
      du_given[i] = draws.uniform(-1, 1);
    }
    for (int i = joint.first_element; i < joint.first_element + joint.n_elements; ++i)
      model.loops.elements[i].prescribed = true;
  }
  /// Rotors on all coordinates of all loop joints, equal along those of one element.
  void add_rotors(Draws& draws) {
    for (const Element& e : model.loops.elements) {
      const double inertia = draws.uniform(0.1, 2);
      for (int i = e.v; i < e.v + e.nv; ++i)
        model.loops.dof[static_cast<int>(DofProperty::armature)][i] = inertia;
    }
  }

  /// Ties one-axis joints of the tree to each other, as they stand; curved: by polynomials.
  void couple(int n_terms, Draws& draws, bool curved = false) {
    Coupling coupling;
    coupling.name = "coupling" + std::to_string(model.couplings.size());
    std::vector<int> joints;
    for (int j = 0; j < tree.n_joints(); ++j)
      if (tree.joints[j].nq == 1) joints.push_back(j);
    for (int t = 0; t < n_terms && !joints.empty(); ++t) {
      const auto chosen = joints.begin() + draws.below(static_cast<int>(joints.size()));
      const JointInfo& joint = tree.joints[*chosen];
      coupling.terms.push_back({*chosen, joint.body, joint.q, joint.v, draws.uniform(0.3, 2)});
      Coupling::Term& term = coupling.terms.back();
      if (curved)
        for (double& x : term.higher) x = draws.uniform(-0.5, 0.5);
      coupling.offset += term.value(q[joint.q]);
      joints.erase(chosen);
    }
    if (!coupling.terms.empty()) model.couplings.push_back(coupling);
  }

  /// Adds a wrench on a body, in its frame, to external wrenches [n_joints][6] of users' frames.
  void push(int body, const Force<double>& w, std::vector<double>& external) const {
    for (int j = 0; j < tree.n_joints(); ++j) {
      const JointInfo& joint = tree.joints[j];
      if (joint.body != body || !joint.last_of_body) continue;
      const auto user = to_array(inverse_transpose_times(joint.to_user, w));
      for (int i = 0; i < 6; ++i) external[6 * j + i] += user[i];
    }
  }

  SweepInput<double> input() const {
    SweepInput<double> in;
    in.q = q.data();
    in.v = v.data();
    if (!v_given.empty()) {
      in.loop_q = q_loops.data();
      in.loop_v = v_given.data();
      in.loop_du = du_given.data();
    }
    return in;
  }

  /// K [rows][nv], by unit rates: slips of the loops.
  std::vector<double> rows(int& n_rows) const {
    LoopStates states(model);
    std::vector<std::vector<double>> columns;
    std::vector<double> unit(tree.nv());
    for (int k = 0; k < tree.nv(); ++k) {
      unit[k] = 1;
      SweepInput<double> in = input();
      in.v = unit.data();
      states.update(in);
      columns.push_back({});
      for (int l = 0; l < model.n_loops(); ++l)
        columns.back().insert(columns.back().end(), states[l].slip,
                              states[l].slip + states[l].held);
      for (const Coupling& coupling : model.couplings) {
        columns.back().push_back(0);
        for (const Coupling::Term& term : coupling.terms)
          if (term.v == k) columns.back().back() += term.slope(q[term.q]);
      }
      unit[k] = 0;
    }
    n_rows = columns.empty() ? 0 : static_cast<int>(columns[0].size());
    std::vector<double> K(static_cast<size_t>(n_rows) * tree.nv());
    for (int i = 0; i < n_rows; ++i)
      for (int k = 0; k < tree.nv(); ++k) K[i * tree.nv() + k] = columns[k][i];
    return K;
  }

  /// Rates that keep the loops closed: v -= K^T (K K^T)^+ K v. Returns the rank of K.
  int make_consistent() {
    int n = 0;
    const std::vector<double> K = rows(n);
    const int nv = tree.nv();
    std::vector<double> A(static_cast<size_t>(n) * n), b(n), x(n);
    SemidefiniteFactor factor;
    for (int twice = 0; twice < 2; ++twice) {
      for (int i = 0; i < n; ++i) {
        b[i] = 0;
        for (int k = 0; k < nv; ++k) b[i] += K[i * nv + k] * v[k];
        for (int j = 0; j < n; ++j) {
          A[i * n + j] = 0;
          for (int k = 0; k < nv; ++k) A[i * n + j] += K[i * nv + k] * K[j * nv + k];
        }
      }
      factor.factor(n, A.data(), 1e-9);
      factor.solve(b.data(), x.data());
      for (int k = 0; k < nv; ++k)
        for (int i = 0; i < n; ++i) v[k] -= K[i * nv + k] * x[i];
    }
    return factor.rank();
  }
};

}  // namespace linkwise::testing
