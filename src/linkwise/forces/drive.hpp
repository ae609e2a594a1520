#pragma once
// What acts on the joints and bodies from outside: drives and external wrenches.
#include <functional>
#include <optional>
#include <vector>

#include "linkwise/forces/breakpoints.hpp"
#include "linkwise/forces/table.hpp"
#include "linkwise/model/frame.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

enum class DriveKind { free, torque, torque_table, torque_callable, pd, locked, motion };

/// Whether the joint's motion is given, so that its drive torque is an unknown.
inline bool is_prescribed(DriveKind kind) {
  return kind == DriveKind::locked || kind == DriveKind::motion;
}

/// When a function of the caller's changes its course.
struct FunctionCourse {
  std::vector<double> breakpoints;  ///< as the caller declares them, increasing
  /// Otherwise as a look at it before the run has found it: values over time, of a motion the
  /// accelerations.
  std::optional<Table> sampled;
};

struct Drive {
  DriveKind kind = DriveKind::free;
  std::vector<double> value;  ///< torque, or target of pd; one per degree of freedom
  std::optional<Table> table;
  bool smooth = false;  ///< the table stands for one smooth curve: nowhere does its course change
  /// (t, q of the joint, v of the joint, out): torque of the joint.
  std::function<void(double, const double*, const double*, double*)> callable;
  /// (t, then out: coordinates of the joint and their two derivatives): a motion without a table.
  std::function<void(double, double*, double*, double*)> motion;
  FunctionCourse course;  ///< of either function
  double kp = 0, kd = 0;  ///< N m/rad and N m s/rad, or N/m and N s/m
};

struct Wrench {
  int joint = 0;      ///< the body is this joint's child
  bool world = true;  ///< along the world's axes, or those of the frame where it acts
  /// The joint's user frame -> the frame where it acts.
  Transform<double> placement{Mat3<double>::identity(), {}};
  std::vector<double> value;
  std::optional<Table> table;
  std::function<void(double, double*)> callable;
  FunctionCourse course;  ///< of the function
};

/// Adds the torque of a joint's drive to tau [nv]; its elements are among `elements`, and q, v and
/// tau are those of the tree, or of the joints that close loops.
void add_drive_torque(const JointInfo& joint, const std::vector<Element>& elements,
                      const Drive& drive, double t, const double* q, const double* v, double* tau);

/// One drive per joint; adds those of the tree to tau [nv]. A joint whose motion is given gets
/// none. pd: kp (target - q) + kd (dtarget/dt - dq/dt) along the coordinates, for joints whose
/// coordinates are angles and distances.
void add_drive_torques(const Model& model, const std::vector<Drive>& drives, double t,
                       const double* q, const double* v, double* tau);

/// Coordinates, rates and accelerations of the joint, [its nv] each, that its motion drive gives at
/// time t. The drive states coordinates and their derivatives; a planar joint's rates are those of
/// the child's frame.
void evaluate_motion(const JointInfo& joint, const Drive& drive, double t, double* q, double* v,
                     double* a);

/// The times at which the drive or wrench changes its course by itself, whatever the state; empty
/// for constants. What is less than a share of `largest`, the largest action of any of them, may be
/// rounding.
Breakpoints breakpoints(const Drive& drive, double tolerance, double largest);
Breakpoints breakpoints(const Wrench& wrench, double tolerance, double largest);
double largest_action(const Drive& drive);
double largest_action(const Wrench& wrench);

/// A wrench without its value yet. axes: "world", or "frame" for those of the one where it acts.
/// InputError where the axes are unknown or the frame is on the ground.
Wrench wrench_at(const Model& model, const Frame& frame, const std::string& axes);

/// InputError, naming the joint, where it cannot have such a drive, or the drive makes no sense.
void check_drive(const Model& model, const JointInfo& joint, const Drive& drive);
/// InputError where declared breakpoints do not increase.
void check_course(const FunctionCourse& course);

/// InputError about a wrench on the child link of a joint where that is no body.
[[noreturn]] void refuse_wrench(const Model& model, int joint);

/// Adds the wrenches to external [n_joints][6], at and in the joints' outboard frames.
void add_wrenches(const Model& model, const std::vector<Wrench>& wrenches, double t,
                  const double* poses, double* external);

}  // namespace linkwise
