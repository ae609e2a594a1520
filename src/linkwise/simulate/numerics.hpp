#pragma once
// The numerical options of a simulation, as users give them: names, defaults and texts in one
// table, from which Python, scenarios and documents take them.
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "linkwise/simulate/setup.hpp"

namespace linkwise {

struct Numerics {
  double tolerance = 1e-6;
  std::optional<double> step_tolerance;
  std::string integrator = "auto";
  std::optional<double> step, max_step;
  std::string method = "auto";
  std::string solver = "auto";
  std::string initial_guess = "cubic";
  std::string stop = "energy_norm";
  std::optional<double> solver_tolerance;
  std::optional<int> max_iterations, max_steps;
  std::string state = "joint_rates";
  std::string assemble = "nearest";
};

struct NumericsEntry {
  std::string_view name;
  std::variant<double Numerics::*, std::optional<double> Numerics::*,
               std::optional<int> Numerics::*, std::string Numerics::*>
      member;
  std::string_view description;
  std::string_view units = "";

  /// What is given: a number, a count or a name.
  std::string_view kind() const {
    constexpr std::string_view kinds[] = {"number", "number", "count", "name"};
    return kinds[member.index()];
  }
};

std::span<const NumericsEntry> numerics_table();
/// InputError, listing the known names, when the name is unknown.
const NumericsEntry& find_numerics(std::string_view name);

/// What follows for a simulation; solver options go before what numerics say. InputError where a
/// number is out of range or a name unknown.
SimulationOptions simulation_options(const Numerics& numerics, const Executor& executor,
                                     const SolverOptionValues& solver_options = {});

}  // namespace linkwise
