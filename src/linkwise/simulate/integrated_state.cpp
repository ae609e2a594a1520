#include "linkwise/simulate/integrated_state.hpp"

#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/simulate/body_velocity_state.hpp"

namespace linkwise {
namespace {

template <class State>
std::unique_ptr<IntegratedState> make(const Model& model, const DynamicsOptions& options,
                                      IntegratedState::Host host) {
  return std::make_unique<State>(model, options, std::move(host));
}

constexpr StateEntry table[] = {
    {"body_velocities", make<BodyVelocityState>},
};

}  // namespace

const StateEntry* find_state(std::string_view name) {
  std::string known = "joint_rates";
  if (name == known) return nullptr;
  for (const StateEntry& entry : table) {
    if (entry.name == name) return &entry;
    known += ", " + std::string(entry.name);
  }
  throw InputError("state '" + std::string(name) + "' is unknown; known: " + known);
}

}  // namespace linkwise
