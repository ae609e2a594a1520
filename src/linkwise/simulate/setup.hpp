#pragma once
// What all members of a simulation have in common: the machine, what drives it, and the numerics.
#include <memory>
#include <vector>

#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/forces/drive.hpp"
#include "linkwise/integrate/integrator.hpp"
#include "linkwise/simulate/integrated_state.hpp"

namespace linkwise {

struct SimulationOptions {
  DynamicsOptions dynamics;
  const StateEntry* state = nullptr;  ///< null: coordinates and joint rates
  /// The energy-norm rule of an iterative solver follows the integrator's error test, where it has
  /// one: see SolverTolerance. Otherwise its tolerance is that of the solver options.
  bool follow_error_test = false;
  std::string integrator = "auto";
  /// Whether a start that leaves loops open is refused, and not moved to where they are closed.
  bool exact_start = false;
  IntegratorOptions integration;
};

struct Setup {
  /// InputError where options are out of range or do not fit the model.
  Setup(std::shared_ptr<const Model> model, SimulationOptions options);

  std::shared_ptr<const Model> model;  ///< as the user sees it
  SimulationOptions options;
  Choice choice;
  /// One per joint, those that close loops last; changed by set_drive().
  std::vector<Drive> drives;
  std::vector<Wrench> wrenches;

  /// InputError where the joint takes no such drive, or the body no wrench.
  void set_drive(int joint, Drive drive);
  void add_wrench(Wrench wrench);

  /// Computes what follows from the drives, where one has changed. Simulations that share a setup
  /// call it from several threads: settle it before.
  void settle();
  /// The model with the joints of given motion prescribed.
  const Model& driven() const { return driven_ ? *driven_ : *model; }
  bool any_given() const { return driven_ != nullptr; }
  bool any_motion() const { return any_motion_; }
  /// Whether anything but gravity, springs and what holds locked joints may do work.
  bool does_work() const;
  /// Whether drives or wrenches are functions of the caller's.
  bool calls_functions() const;
  /// Of every drive and wrench that has some.
  const std::vector<Breakpoints>& breakpoints() const { return breakpoints_; }

 private:
  void find_breakpoints();

  std::unique_ptr<const Model> driven_;
  std::vector<Breakpoints> breakpoints_;
  bool any_motion_ = false, settled_ = false;
};

/// InputError where a setup has what several members cannot share. They are computed by
/// articulated_body in fixed steps, and functions of Python are asked for one member alone.
void check_members(const Setup& setup);

}  // namespace linkwise
