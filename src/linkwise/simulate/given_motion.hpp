#pragma once
// What a state must satisfy besides its equations of motion: quaternions of unit length, and joints
// that follow a given motion or are locked.
#include <memory>
#include <vector>

#include "linkwise/forces/drive.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Scales the quaternions of q [nq] to unit length.
void normalise_quaternions(const Model& model, double* q);

/// InputError, naming the joint, where a quaternion of q is too short to have a direction.
void check_quaternions(const Model& model, const double* q);

/// InputError, naming the joint, where a locked joint starts with a rate.
void check_locked_joints(const Model& model, const std::vector<Drive>& drives, const double* v0);

/// The model with the joints of given motion prescribed; null where no drive gives a motion.
std::unique_ptr<const Model> driven_model(const Model& model, const std::vector<Drive>& drives);

/// Writes what motion drives give at time t into q [nq], v [nv] and the accelerations a [nv].
void impose_motion(const Model& model, const std::vector<Drive>& drives, double t, double* q,
                   double* v, double* a);

/// Sets the entries of joints with a motion drive to zero in the rates of q and v: their state is
/// given, not integrated.
void rest_imposed(const Model& model, const std::vector<Drive>& drives, double* q_rate,
                  double* v_rate);

}  // namespace linkwise
