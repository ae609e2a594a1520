#include "linkwise/simulate/setup.hpp"

#include <algorithm>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {

Setup::Setup(std::shared_ptr<const Model> model_, SimulationOptions options_)
    : model(std::move(model_)),
      options(std::move(options_)),
      choice(choose_dynamics(*model, options.dynamics)),
      drives(model->n_loads()) {
  // Made once here so that bad options are refused before anything is written.
  if (options.state) {
    if (options.dynamics.method == "auto") options.dynamics.method = "constraint_force";
    choice = choose_dynamics(*model, options.dynamics);
    options.state->make(*model, options.dynamics, {});
  }
  make_dynamics(*model, options.dynamics);
  check_integrator(options.integrator, options.integration);
}

void Setup::set_drive(int joint, Drive drive) {
  check_drive(*model, model->joint_at(joint), drive);
  drives[joint] = std::move(drive);
  settled_ = false;
}

void Setup::add_wrench(Wrench wrench) {
  if (!model->joints[wrench.joint].last_of_body) refuse_wrench(*model, wrench.joint);
  check_course(wrench.course);
  wrenches.push_back(std::move(wrench));
  settled_ = false;
}

bool Setup::does_work() const {
  bool driven = false;
  for (const Drive& drive : drives)
    driven |= drive.kind != DriveKind::free && drive.kind != DriveKind::locked;
  return driven || !wrenches.empty() || model->has_passive_forces() ||
         has_passive_forces(model->loops);
}

bool Setup::calls_functions() const {
  bool any = false;
  for (const Drive& drive : drives) any |= drive.callable || drive.motion;
  for (const Wrench& wrench : wrenches) any |= static_cast<bool>(wrench.callable);
  return any;
}

void Setup::settle() {
  if (settled_) return;
  if (options.state)
    refuse_loops(*model, "state " + std::string(options.state->name), "use the state joint_rates");
  any_motion_ = false;
  for (const Drive& drive : drives) any_motion_ |= drive.kind == DriveKind::motion;
  if (any_motion_ && options.state)
    throw InputError("state " + std::string(options.state->name) +
                     " takes no motion drives; use the state joint_rates for them");
  driven_ = driven_model(*model, drives);
  for (const Element& e : driven().elements)
    if (options.state && !e.prescribed && has_armature_bias(driven(), e))
      throw InputError("state " + std::string(options.state->name) + " takes no armatures" +
                       model->where() +
                       " on floating, planar and spherical joints; use the state joint_rates");
  require_determined(driven());
  find_breakpoints();
  settled_ = true;
}

/// As fine as the error test can tell, but neither finer than tables are written nor so coarse that
/// what acts is not seen.
void Setup::find_breakpoints() {
  constexpr double finest = 1e-8, coarsest = 1e-4;
  const IntegratorOptions& o = options.integration;
  const double tolerance =
      std::clamp(o.relative_tolerance > 0 ? o.relative_tolerance : o.tolerance, finest, coarsest);
  breakpoints_.clear();
  const auto keep = [this](Breakpoints found) {
    if (!found.times.empty()) breakpoints_.push_back(std::move(found));
  };
  double largest = 0;
  for (const Drive& drive : drives) largest = std::max(largest, largest_action(drive));
  for (const Wrench& wrench : wrenches) largest = std::max(largest, largest_action(wrench));
  for (const Drive& drive : drives) keep(linkwise::breakpoints(drive, tolerance, largest));
  for (const Wrench& wrench : wrenches) keep(linkwise::breakpoints(wrench, tolerance, largest));
}

void check_members(const Setup& setup) {
  const SimulationOptions& options = setup.options;
  if (options.dynamics.method != "articulated_body")
    throw InputError("method '" + options.dynamics.method + "': a batch takes articulated_body");
  if (options.state)
    throw InputError("state " + std::string(options.state->name) + ": a batch takes joint_rates");
  if (!find_integrator(options.integrator).fixed_step)
    throw InputError("integrator '" + options.integrator +
                     "' chooses its own steps; a batch takes " + fixed_step_names());
  for (size_t j = 0; j < setup.drives.size(); ++j)
    if (setup.drives[j].callable || setup.drives[j].motion)
      throw InputError("drives['" + setup.model->joint_at(static_cast<int>(j)).name +
                       "'] is a function; a batch takes numbers and tables");
  for (const Wrench& wrench : setup.wrenches)
    if (wrench.callable)
      throw InputError("wrenches: a function is given; a batch takes numbers and tables");
}

}  // namespace linkwise
