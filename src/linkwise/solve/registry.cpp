#include "linkwise/solve/registry.hpp"

#include <array>
#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/solve/direct/thomas.hpp"
#include "linkwise/solve/iterative/conjugate_gradient.hpp"

namespace linkwise {
namespace {

constexpr std::array<SolverEntry, 2> table{{
    {"thomas", "block elimination, leaf to root; hubs in linear time", SolverKind::direct, false,
     "golub2013", make_thomas},
    {"conjugate_gradient", "conjugate gradients with the block diagonal as preconditioner (J-CG)",
     SolverKind::iterative, true, "sharf1993", make_conjugate_gradient},
}};

}  // namespace

std::string_view to_string(SolverKind kind) {
  return kind == SolverKind::direct ? "direct" : "iterative";
}

std::span<const SolverEntry> solver_table() { return table; }

const SolverEntry& find_solver(std::string_view name) {
  std::string known;
  for (const SolverEntry& entry : table) {
    if (entry.name == name) return entry;
    known += (known.empty() ? " " : ", ") + std::string(entry.name);
  }
  throw InputError("unknown solver '" + std::string(name) + "'; known are" + known);
}

std::unique_ptr<LinearSolver> make_solver(std::string_view name, const SolverOptions& options) {
  const SolverEntry& entry = find_solver(name);
  validate(options);
  return entry.make(options);
}

}  // namespace linkwise
