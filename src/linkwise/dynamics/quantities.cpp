#include "linkwise/dynamics/quantities.hpp"

#include <algorithm>

#include "linkwise/forces/passive.hpp"
#include "linkwise/kinematics/loop_states.hpp"

namespace linkwise {
namespace {

/// World -> frame of every element, in element order; the last of a body is the body's frame.
std::vector<Transform<double>> element_frames(const Model& model, const double* q) {
  std::vector<Transform<double>> frames(model.elements.size());
  for (const BodyTopology& body : model.topology) {
    const BodyTopology* parent = body.parent >= 0 ? &model.topology[body.parent] : nullptr;
    int previous = parent ? parent->first_element + parent->n_elements - 1 : -1;
    for (int i = 0; i < body.n_elements; ++i) {
      const int e = body.first_element + i;
      const auto X = element_pose(model.elements[e], q);
      frames[e] = previous >= 0 ? X * frames[previous] : X;
      previous = e;
    }
  }
  return frames;
}

void store_pose(const Transform<double>& X, double* pose) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose[4 * i + j] = X.R.m[3 * j + i];
    pose[12 + i] = 0;
  }
  pose[3] = X.r.x;
  pose[7] = X.r.y;
  pose[11] = X.r.z;
  pose[15] = 1;
}

Transform<double> joint_frame(const JointInfo& joint,
                              const std::vector<Transform<double>>& frames) {
  const auto& X = frames[joint.first_element + joint.n_elements - 1];
  return joint.to_user * X;
}

std::vector<BodyState<double>> states_of(const Model& model, const double* q, const double* v) {
  std::vector<BodyState<double>> states(model.n_bodies());
  std::vector<GeneralState<double>> general(model.n_general);
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  calc_body_states(model, in, states.data(), general.data());
  return states;
}

/// f(body n), or f(body n, its own state).
template <class F>
auto ask_body(const Model& model, const double* q, const double* v, int n, F&& f) {
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  return with_body(model, n,
                   [&](const auto& body) { return with_own_state(body, model, in, n, f); });
}

LoopStates loop_states(const Model& model, const double* q, const double* v) {
  LoopStates loops(model);
  SweepInput<double> in;
  in.q = q;
  in.v = v;
  loops.update(in);
  return loops;
}

}  // namespace

void joint_poses(const Model& model, const double* q, double* poses) {
  const auto frames = element_frames(model, q);
  for (int j = 0; j < model.n_joints(); ++j)
    store_pose(joint_frame(model.joints[j], frames), poses + 16 * j);
}

void link_poses(const Model& model, const double* q, double* poses) {
  const auto frames = element_frames(model, q);
  for (size_t l = 0; l < model.links.size(); ++l) {
    const LinkInfo& link = model.links[l];
    store_pose(link.joint >= 0 ? link.placement * joint_frame(model.joints[link.joint], frames)
                               : link.placement,
               poses + 16 * l);
  }
}

double kinetic_energy(const Model& model, const double* q, const double* v) {
  const auto states = states_of(model, q, v);
  double energy = 0;
  for (int n = 0; n < model.n_bodies(); ++n)
    energy += ask_body(model, q, v, n, [&](const auto& body, const auto&... inside) {
      return kinetic_energy(body, states[n].v, inside...);
    });
  const auto& armature = model.dof_values(DofProperty::armature);
  for (int i = 0; i < model.nv(); ++i) energy += 0.5 * armature[i] * v[i] * v[i];
  const auto& of_loops = model.loops.dof[static_cast<int>(DofProperty::armature)];
  if (std::none_of(of_loops.begin(), of_loops.end(), [](double x) { return x > 0; })) return energy;
  const std::vector<double> u = loop_states(model, q, v).v();
  for (size_t i = 0; i < u.size(); ++i) energy += 0.5 * of_loops[i] * u[i] * u[i];
  return energy;
}

double potential_energy(const Model& model, const double* q, const double* loop_q) {
  const auto frames = element_frames(model, q);
  double energy = passive_potential(model, q);
  if (has_passive_forces(model.loops))
    energy +=
        passive_potential(model.loops, loop_q ? loop_q : loop_states(model, q, nullptr).q().data());
  for (int n = 0; n < model.n_bodies(); ++n) {
    const auto& X = frames[model.topology[n].first_element + model.topology[n].n_elements - 1];
    energy += ask_body(model, q, nullptr, n, [&](const auto& body, const auto&... inside) {
      return potential_energy(body, X, model.gravity, inside...);
    });
  }
  return energy;
}

void momentum(const Model& model, const double* q, const double* v, double* h) {
  const auto frames = element_frames(model, q);
  const auto states = states_of(model, q, v);
  Force<double> total;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const auto& X = frames[model.topology[n].first_element + model.topology[n].n_elements - 1];
    total +=
        transpose_times(X, ask_body(model, q, v, n, [&](const auto& body, const auto&... inside) {
                          return momentum(body, states[n].v, inside...);
                        }));
  }
  const double values[6] = {total.lin.x, total.lin.y, total.lin.z,
                            total.ang.x, total.ang.y, total.ang.z};
  for (int i = 0; i < 6; ++i) h[i] = values[i];
}

}  // namespace linkwise
