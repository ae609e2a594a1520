// Quantities of a state without its accelerations: poses, Jacobians, energies, momenta, mass
// matrix.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "bind.hpp"
#include "doc_text.hpp"
#include "frame.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/kinematics/frame_motion.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

/// f(model, q, v, du, out) for every state, over threads; out has `tail` numbers. v and du are zero
/// where they are None.
template <class F>
nb::object map_motions(const PyModel& self, nb::handle q, nb::handle v, nb::handle acceleration,
                       nb::handle threads, const Shape& tail, F&& f) {
  const Model& m = *self.model;
  States s(m, q, v, acceleration, "acceleration", nb::none());
  NewArray out(s.lead, tail);
  const size_t n = product(tail);
  const Executor executor = executor_for(whole_number(threads, "threads"), s.count * m.n_bodies());
  const std::vector<double> zero(m.nv());
  without_gil([&](const GoOn& go_on) {
    for_each_part(m, s.count, executor, go_on, [&](size_t first, size_t count) {
      for (size_t i = first; i < first + count; ++i)
        f(m, s.q.data + i * m.nq(), s.v.given ? s.v.data + i * m.nv() : zero.data(),
          s.tau.given ? s.tau.data + i * m.nv() : zero.data(), out.data + i * n);
    });
  });
  check_result(out.data, s.count * n);
  return s.lead.empty() && tail.empty() ? nb::object(nb::float_(out.data[0])) : out.array;
}

/// The same with f(model, q, v, out).
template <class F>
nb::object map_states(const PyModel& self, nb::handle q, nb::handle v, nb::handle threads,
                      const Shape& tail, F&& f) {
  return map_motions(self, q, v, nb::none(), threads, tail,
                     [&f](const Model& m, const double* q, const double* v, const double*,
                          double* out) { f(m, q, v, out); });
}

/// Shapes of results.
Shape scalar(const Model&) { return {}; }
Shape six(const Model&) { return {6}; }
Shape per_rate(const Model& m) { return {size(m.nv())}; }
Shape pose_per_joint(const Model& m) { return {size(m.n_joints()), 4, 4}; }
Shape pose_per_link(const Model& m) { return {m.links.size(), 4, 4}; }

using OfPositions = void (*)(const Model&, const double* q, double* out);
using OfStates = void (*)(const Model&, const double* q, const double* v, double* out);
using ShapeOf = Shape (*)(const Model&);

/// NAME(model, q, *, threads).
void of_positions(nb::module_& m, const char* name, ShapeOf shape, OfPositions f, const char* title,
                  const char* returns) {
  m.def(
      name,
      [shape, f](const PyModel& self, nb::handle q, nb::handle threads) {
        return map_states(
            self, q, nb::none(), threads, shape(*self.model),
            [f](const Model& m, const double* q, const double*, double* out) { f(m, q, out); });
      },
      "model"_a, "q"_a, nb::kw_only(), "threads"_a = nb::none(),
      doc::text(title, {doc::q}, returns).c_str());
}

/// NAME(model, q, v, *, threads).
void of_states(nb::module_& m, const char* name, ShapeOf shape, OfStates f, const char* title,
               const char* returns) {
  m.def(
      name,
      [shape, f](const PyModel& self, nb::handle q, nb::handle v, nb::handle threads) {
        return map_states(self, q, v, threads, shape(*self.model), f);
      },
      "model"_a, "q"_a, "v"_a, nb::kw_only(), "threads"_a = nb::none(),
      doc::text(title, {doc::q_v}, returns).c_str());
}

void passive_torque(const Model& m, const double* q, const double* v, double* out) {
  std::fill(out, out + m.nv(), 0.0);
  add_passive_forces(m, q, v, out);
}

void bind_forces(nb::module_& m) {
  of_states(m, "passive_torque", &per_rate, &passive_torque,
            "Torque of the joints' own damping, friction, springs and compliant stops.",
            "    (..., nv) [N m, N], to be added to the drives' torque; docs/theory/forces.md has "
            "the laws.");
}

void bind_energies(nb::module_& m) {
  of_states(
      m, "kinetic_energy", &scalar,
      [](const Model& m, const double* q, const double* v, double* out) {
        *out = kinetic_energy(m, q, v);
      },
      "Kinetic energy of the bodies and of the rotors (armature), v^T H v / 2.", "    (...) [J].");
  of_positions(
      m, "potential_energy", &scalar,
      [](const Model& m, const double* q, double* out) { *out = potential_energy(m, q); },
      "Potential energy of gravity (zero at the world origin), joint springs and stops.",
      "    (...) [J].");
  of_states(m, "momentum", &six, &momentum,
            "Momentum of all bodies about the world origin, in world axes; rotors are left out.",
            "    (..., 6): linear [kg m/s], then angular [kg m2/s].");
}

/// The joint of a body given by the name of its link or by index.
int joint_of(const PyModel& self, nb::handle body) {
  int joint = -1;
  if (nb::isinstance<nb::str>(body)) {
    const LinkInfo& link = self.model->links[self.model->link_index(name_in(body, "body"))];
    joint = link.joint;
    if (joint < 0 || self.model->links[self.model->joints[joint].link].name != link.name)
      throw InputError("link '" + link.name +
                       "' is merged into the body that carries it; frame_jacobian takes any link");
  } else {
    joint = whole_number(body, "body").value_or(0);
    if (joint < 0 || joint >= self.model->n_joints())
      throw InputError("body index " + std::to_string(joint) + " is out of range; the model has " +
                       std::to_string(self.model->n_joints()) + " bodies");
  }
  return joint;
}

void bind_poses(nb::module_& m) {
  of_positions(m, "joint_poses", &pose_per_joint, &joint_poses,
               "Poses of the joint frames, each fixed in its joint's child link.",
               "    (..., n_joints, 4, 4): matrices that take points [m] of a joint frame to the "
               "world.");
  of_positions(
      m, "link_poses", &pose_per_link, &link_poses,
      "Poses of all links of the source, merged ones too.",
      R"(    (..., links, 4, 4) in the order of Model.link_names: matrices that take points [m] of a link's
    frame to the world.)");
  m.def(
      "body_jacobian",
      [](const PyModel& self, nb::handle q, nb::handle body, nb::handle threads) {
        const int joint = joint_of(self, body);
        return map_states(self, q, nb::none(), threads, {6, size(self.model->nv())},
                          [joint](const Model& m, const double* q, const double*, double* out) {
                            frame_jacobian(m, q, {.joint = joint}, false, out);
                          });
      },
      "model"_a, "q"_a, "body"_a, nb::kw_only(), "threads"_a = nb::none(),
      doc::text(
          R"(Geometric Jacobian J of a body [featherstone2008, ch. 2]: J v is the velocity of its joint
frame.)",
          {doc::q, "    body: name of a joint's child link, or the index of the joint.\n"},
          R"(    J (..., 6, nv): rows are the velocity of the joint point [m/s] and the angular velocity [rad/s],
    in the axes of the joint frame.)",
          R"(the body is unknown or welded to another, shapes do not fit the model, or a number
        is not finite.)")
          .c_str());
}

/// Whether components are along the world's axes, or the frame's.
bool in_world(const std::string& axes) {
  if (axes != "world" && axes != "frame")
    throw InputError("axes: '" + axes + "' is unknown; use world or frame");
  return axes == "world";
}

void store(const Motion<double>& m, double* out) {
  const double values[6] = {m.lin.x, m.lin.y, m.lin.z, m.ang.x, m.ang.y, m.ang.z};
  std::copy(values, values + 6, out);
}

void store(const Transform<double>& X, double* pose) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) pose[4 * i + j] = X.R.m[3 * j + i];
  pose[3] = X.r.x;
  pose[7] = X.r.y;
  pose[11] = X.r.z;
  for (int j = 0; j < 4; ++j) pose[12 + j] = j == 3;
}

/// The frame's motion, or one part of it, for every state.
template <class Part>
nb::object map_frame_motion(const PyModel& self, nb::handle q, nb::handle v,
                            nb::handle acceleration, nb::handle frame, const std::string& axes,
                            nb::handle threads, Part part) {
  const FramePlacement at = place_frame(*self.model, as_frame(frame));
  const bool world = in_world(axes);
  return map_motions(
      self, q, v, acceleration, threads, {6},
      [&](const Model& m, const double* q, const double* v, const double* du, double* out) {
        const FrameMotion found = frame_motion(m, q, v, du, at);
        store(world ? in_world_axes(found.pose, found.*part) : found.*part, out);
      });
}

constexpr const char* components =
    "    axes: of the components: \"world\", or \"frame\" for the frame's own.\n";

void bind_frame_places(nb::module_& m) {
  m.def(
      "frame_pose",
      [](const PyModel& self, nb::handle q, nb::handle frame, nb::handle threads) {
        const FramePlacement at = place_frame(*self.model, as_frame(frame));
        return map_states(self, q, nb::none(), threads, {4, 4},
                          [&](const Model& m, const double* q, const double*, double* out) {
                            store(frame_motion(m, q, nullptr, nullptr, at).pose, out);
                          });
      },
      "model"_a, "q"_a, "frame"_a, nb::kw_only(), "threads"_a = nb::none(),
      doc::text(R"(Pose of a frame on any link.)", {doc::q, doc::frame},
                R"(    (..., 4, 4): matrix that takes points [m] of the frame to the world.)",
                doc::unknown_link)
          .c_str());
  m.def(
      "frame_jacobian",
      [](const PyModel& self, nb::handle q, nb::handle frame, const std::string& axes,
         nb::handle threads) {
        const FramePlacement at = place_frame(*self.model, as_frame(frame));
        const bool world = in_world(axes);
        return map_states(self, q, nb::none(), threads, {6, size(self.model->nv())},
                          [&](const Model& m, const double* q, const double*, double* out) {
                            frame_jacobian(m, q, at, world, out);
                          });
      },
      "model"_a, "q"_a, "frame"_a, nb::kw_only(), "axes"_a = "world", "threads"_a = nb::none(),
      doc::text(
          R"(Geometric Jacobian J of a frame on any link [featherstone2008, ch. 2]: J v is its velocity, and
J^T f the joint torques of a force and moment f on it.)",
          {doc::q, doc::frame,
           "    axes: of the rows: \"world\", or \"frame\" for the frame's own.\n"},
          R"(    J (..., 6, nv): rows are the velocity of the frame's origin [m/s] and the angular velocity
    [rad/s]. Zero on the ground.)",
          doc::unknown_link)
          .c_str());
}

void bind_frame_motions(nb::module_& m) {
  m.def(
      "frame_velocity",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle frame, const std::string& axes,
         nb::handle threads) {
        return map_frame_motion(self, q, v, nb::none(), frame, axes, threads,
                                &FrameMotion::velocity);
      },
      "model"_a, "q"_a, "v"_a, "frame"_a, nb::kw_only(), "axes"_a = "world",
      "threads"_a = nb::none(),
      doc::text(
          R"(Velocity of a frame on any link against the world.)",
          {doc::q_v, doc::frame, components},
          R"(    (..., 6): velocity of the frame's origin [m/s], then angular velocity [rad/s].)",
          doc::unknown_link)
          .c_str());
  m.def(
      "frame_acceleration",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle acceleration, nb::handle frame,
         const std::string& axes, nb::handle threads) {
        return map_frame_motion(self, q, v, acceleration, frame, axes, threads,
                                &FrameMotion::acceleration);
      },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(), "frame"_a, nb::kw_only(),
      "axes"_a = "world", "threads"_a = nb::none(),
      doc::text(
          R"(Acceleration of a frame on any link against the world, without gravity.)",
          {R"(    q: positions (..., nq) [rad, m]; v: rates (..., nv) [rad/s, m/s]; acceleration: of the joints
        (..., nv) [rad/s2, m/s2]. Leading axes broadcast; None: zero.
)",
           doc::frame, components},
          R"(    (..., 6): second derivative of the origin's position [m/s2], then angular acceleration
    [rad/s2]. An accelerometer there feels the first less gravity.)",
          doc::unknown_link)
          .c_str());
}

}  // namespace

void bind_kinematics(nb::module_& m) {
  m.def("require_memory", &require_memory, "bytes"_a, "what"_a,
        "MemoryError, with the estimate, where so many bytes are not available.");
  bind_forces(m);
  bind_energies(m);
  bind_poses(m);
  bind_frame_places(m);
  bind_frame_motions(m);
}

}  // namespace linkwise::bindings
