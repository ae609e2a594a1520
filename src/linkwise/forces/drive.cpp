#include "linkwise/forces/drive.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "linkwise/base/error.hpp"
#include "linkwise/forces/coordinate_forces.hpp"

namespace linkwise {
namespace {

/// The least scale of a motion's velocities, as in the integrator's error test, rad/s or m/s.
constexpr double motion_floor = 0.01;
/// A torque may be the rounding error of another one.
constexpr double rounding_share = 1e-9;

double largest_value(const std::optional<Table>& table) {
  if (!table) return 0;
  double largest = 0;
  std::vector<double> values(table->columns);
  for (const double t : table->breaks) {
    table->evaluate(t, values.data());
    for (const double value : values) largest = std::max(largest, std::abs(value));
  }
  return largest;
}

Breakpoints of_function(const FunctionCourse& course, TableAction action, double tolerance) {
  if (course.sampled) return find_breakpoints(*course.sampled, action, tolerance);
  return {course.breakpoints, std::vector(course.breakpoints.size(), Breakpoints::Kind::jump)};
}

}  // namespace

void add_drive_torque(const JointInfo& joint, const std::vector<Element>& elements,
                      const Drive& drive, double t, const double* q, const double* v, double* tau) {
  if (drive.kind == DriveKind::free || is_prescribed(drive.kind)) return;
  double values[6], target_rates[6] = {};
  if (drive.table) {
    drive.table->evaluate(t, values);
    if (drive.kind == DriveKind::pd) drive.table->evaluate(t, target_rates, 1);
  } else if (drive.callable) {
    drive.callable(t, q + joint.q, v + joint.v, values);
  } else {
    for (int i = 0; i < joint.nv; ++i) values[i] = drive.value[i];
  }
  if (drive.kind != DriveKind::pd) {
    for (int i = 0; i < joint.nv; ++i) tau[joint.v + i] += values[i];
    return;
  }
  for (int i = joint.first_element; i < joint.first_element + joint.n_elements; ++i) {
    const Element& e = elements[i];
    double rate[3], force[3];
    scalar_rates(e, q, v, rate);
    for (int k = 0; k < e.nv; ++k) {
      const int own = e.v - joint.v + k;
      force[k] = drive.kp * (values[own] - q[e.q + k]) + drive.kd * (target_rates[own] - rate[k]);
    }
    add_coordinate_forces(e, q, force, tau);
  }
}

void add_drive_torques(const Model& model, const std::vector<Drive>& drives, double t,
                       const double* q, const double* v, double* tau) {
  for (int j = 0; j < model.n_joints(); ++j)
    add_drive_torque(model.joints[j], model.elements, drives[j], t, q, v, tau);
}

void evaluate_motion(const JointInfo& joint, const Drive& drive, double t, double* q, double* v,
                     double* a) {
  if (drive.motion) {
    drive.motion(t, q, v, a);
  } else {
    // An integrator may evaluate a little past the last sample. A table that stopped there would
    // show it a jump.
    drive.table->evaluate(t, q, 0, true);
    drive.table->evaluate(t, v, 1, true);
    drive.table->evaluate(t, a, 2, true);
  }
  if (joint.type != JointType::planar) return;
  // v = R^T dq/dt and its derivative, R turning by the third coordinate.
  const double c = std::cos(q[2]), s = std::sin(q[2]);
  const double vx = c * v[0] + s * v[1], vy = c * v[1] - s * v[0];
  const double ax = c * a[0] + s * a[1], ay = c * a[1] - s * a[0];
  v[0] = vx;
  v[1] = vy;
  a[0] = ax + v[2] * vy;
  a[1] = ay - v[2] * vx;
}

double largest_action(const Drive& drive) {
  if (drive.kind == DriveKind::motion) return 0;
  const double scale = drive.kind == DriveKind::pd ? drive.kp : 1;
  return scale * std::max(largest_value(drive.table), largest_value(drive.course.sampled));
}

double largest_action(const Wrench& wrench) {
  return std::max(largest_value(wrench.table), largest_value(wrench.course.sampled));
}

Breakpoints breakpoints(const Drive& drive, double tolerance, double largest) {
  if (drive.smooth) return {};
  TableAction action;
  if (drive.kind != DriveKind::motion) action.least = rounding_share * largest;
  if (drive.kind == DriveKind::motion) {
    action.floor = motion_floor;
    action.extended = true;
  }
  if (!drive.table) return of_function(drive.course, action, tolerance);
  if (drive.kind == DriveKind::motion)
    action.value = 0, action.acceleration = 1;
  else if (drive.kind == DriveKind::pd)
    action.value = drive.kp, action.rate = drive.kd;
  return find_breakpoints(*drive.table, action, tolerance);
}

Breakpoints breakpoints(const Wrench& wrench, double tolerance, double largest) {
  const TableAction action{.least = rounding_share * largest};
  if (wrench.table) return find_breakpoints(*wrench.table, action, tolerance);
  return of_function(wrench.course, action, tolerance);
}

Wrench wrench_at(const Model& model, const Frame& frame, const std::string& axes) {
  if (axes != "world" && axes != "frame")
    throw InputError("axes '" + axes + "' are unknown; known: world, frame");
  const FramePlacement place = place_frame(model, frame);
  if (place.joint < 0)
    throw InputError("link '" + frame.link + "'" + model.where() +
                     " is fixed to the ground, where a wrench moves nothing; give a frame on a "
                     "moving link");
  Wrench wrench;
  wrench.joint = place.joint;
  wrench.world = axes == "world";
  wrench.placement = place.placement;
  return wrench;
}

void check_drive(const Model& model, const JointInfo& joint, const Drive& drive) {
  const bool is_motion = drive.kind == DriveKind::motion, is_pd = drive.kind == DriveKind::pd;
  const std::string head = "joint '" + joint.name + "'" + model.where() + ": ";
  if (joint.nv == 0)
    throw InputError(head + "a fixed joint or rod has no coordinate to drive; drive another joint");
  if (joint.type == JointType::elastic)
    throw InputError(head + "is elastic, and its coordinates have no drive; drive another joint");
  if ((is_pd || is_motion) && joint.nq != joint.nv)
    throw InputError(head + "a " + (is_motion ? "motion" : "pd") +
                     " drive needs angles or distances, not a quaternion; drive it by torque");
  if (is_pd && !(drive.kp >= 0 && drive.kd >= 0 && std::isfinite(drive.kp + drive.kd)))
    throw InputError(head + "gains kp and kd must be finite and >= 0");
  if (is_motion && drive.table && drive.table->degree < 2)
    throw InputError(head + "the velocity of a linear table jumps at every row; use cubic");
  check_course(drive.course);
}

void check_course(const FunctionCourse& course) {
  if (!std::is_sorted(course.breakpoints.begin(), course.breakpoints.end()))
    throw InputError("breakpoints are not increasing; sort them");
}

void refuse_wrench(const Model& model, int joint) {
  throw InputError("link '" + model.links[model.joints[joint].link].name + "'" + model.where() +
                   " between two joints has no mass, so no wrench can act on it; apply it to the "
                   "next body outboard");
}

void add_wrenches(const Model&, const std::vector<Wrench>& wrenches, double t, const double* poses,
                  double* external) {
  for (const Wrench& wrench : wrenches) {
    double w[6];
    if (wrench.table)
      wrench.table->evaluate(t, w);
    else if (wrench.callable)
      wrench.callable(t, w);
    else
      std::copy(wrench.value.begin(), wrench.value.end(), w);
    Force<double> f{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
    if (wrench.world) {
      const double* pose = poses + 16 * wrench.joint;
      double turned[6] = {};
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
          turned[i] += pose[4 * k + i] * w[k];
          turned[3 + i] += pose[4 * k + i] * w[3 + k];
        }
      f = {{turned[0], turned[1], turned[2]}, {turned[3], turned[4], turned[5]}};
      f.ang += cross(wrench.placement.r, f.lin);
    } else {
      f = transpose_times(wrench.placement, f);
    }
    double* out = external + 6 * wrench.joint;
    const double sum[6] = {f.lin.x, f.lin.y, f.lin.z, f.ang.x, f.ang.y, f.ang.z};
    for (int i = 0; i < 6; ++i) out[i] += sum[i];
  }
}

}  // namespace linkwise
