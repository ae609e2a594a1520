#pragma once
// What turns errors of coordinates and rates into forces: springs, PD drives, dampers, friction and
// stops, a row per degree of freedom. Those of what closes loops are counted behind the tree's.
#include <limits>
#include <string>
#include <vector>

#include "linkwise/simulate/setup.hpp"

namespace linkwise {

/// What acts along one coordinate and rate.
struct GainRow {
  int joint = 0, q = -1, v = 0;  ///< q: -1 where it is no angle or distance
  int group = 0, width = 1;      ///< first rate, and how many, whose torques are one vector
  bool closes = false;           ///< the joint closes a loop: see LoopWatch
  double stiffness = 0, damping = 0, friction = 0, friction_velocity = 1;
  double stop = 0, stop_damping = 0;
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  const char* unit = "N m";
};

/// Every degree of freedom that has a gain and is not given.
std::vector<GainRow> gain_rows(const Setup& setup);

/// Of the nearer stop.
struct Contact {
  double depth = 0, speed = 0;  ///< into it; depth is negative in front of it
  double side = 1;              ///< 1: the upper one
};
Contact contact(const GainRow& row, double q, double v);

/// Stiffness of a stop that is met with such a speed [hunt1975].
double stop_stiffness(const GainRow& row, double speed);

/// Of m/s^2 or rad/s^2: what gives an inertia no more than that is no force to be known.
constexpr double no_acceleration = 1e-9;

/// A force or a moment that rounding alone may make of the machine's weight, which shows where it
/// falls freely and its joints carry nothing.
double no_force(const Model& model, const GainRow& row);

/// A force that is not known well.
struct ForceDoubt {
  const GainRow* row = nullptr;
  double error = 0, largest = 0, time = 0;
  double step = 0;  ///< that would do, with fixed steps
  /// Which force may be wrong, by how much, and when; open for the remedy.
  std::string text(const Model& model) const;
};

}  // namespace linkwise
