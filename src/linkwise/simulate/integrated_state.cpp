#include "linkwise/simulate/integrated_state.hpp"

#include <string>

#include "linkwise/base/named.hpp"
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
  constexpr std::string_view usual = "joint_rates";
  return name == usual ? nullptr : &find_named("state", name, table, usual);
}

}  // namespace linkwise
