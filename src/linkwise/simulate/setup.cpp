#include "linkwise/simulate/setup.hpp"

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/body_velocities.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {

StateChoice state_choice_from_name(std::string_view name) {
  if (name == "joint_rates") return StateChoice::joint_rates;
  if (name == "body_velocities") return StateChoice::body_velocities;
  throw InputError("state '" + std::string(name) + "' is unknown; known: joint_rates, " +
                   "body_velocities");
}

Setup::Setup(std::shared_ptr<const Model> model_, SimulationOptions options_)
    : model(std::move(model_)),
      options(std::move(options_)),
      choice(choose_dynamics(*model, options.dynamics)),
      drives(model->n_joints()) {
  // Made once here so that bad options are refused before anything is written.
  if (options.state == StateChoice::body_velocities) {
    if (options.dynamics.method == "auto") options.dynamics.method = "constraint_force";
    choice = choose_dynamics(*model, options.dynamics);
    BodyVelocities(*model, options.dynamics);
  }
  make_dynamics(*model, options.dynamics);
  check_integrator(options.integrator, options.integration);
}

void Setup::settle() {
  any_motion_ = false;
  for (const Drive& drive : drives) any_motion_ |= drive.kind == DriveKind::motion;
  driven_ = driven_model(*model, drives);
}

}  // namespace linkwise
