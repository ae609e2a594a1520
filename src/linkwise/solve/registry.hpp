#pragma once
// The table of linear solvers. One row of it gives a solver its place in C++, Python, the command
// line, the documentation, the contract tests and the benchmarks.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "linkwise/solve/solver.hpp"

namespace linkwise {

enum class SolverKind { direct, iterative };

std::string_view to_string(SolverKind kind);

struct SolverEntry {
  std::string_view name;
  std::string_view description;
  SolverKind kind;
  std::string_view reference;  ///< key in references.bib
  bool chains_only = false;    ///< InputError on trees that branch
  bool takes_loops = false;    ///< takes the graph of a machine with closed loops
  bool parallel = false;       ///< can all nodes work at once, up to sums and short recursions?
  std::unique_ptr<LinearSolver> (*make)(const SolverOptions&);
  OptionList* options = no_options;  ///< its own, besides common_options()
};

std::span<const SolverEntry> solver_table();
/// InputError, listing the known names, when the name is unknown.
const SolverEntry& find_solver(std::string_view name);
/// An option as users know it.
struct SolverOption {
  std::string_view name;
  const Option* option;
  std::string owners;  ///< the solvers or guesses that have it, by name; empty: all solvers
};

/// Every option of every solver and initial guess, each name once.
std::vector<SolverOption> solver_options();
/// InputError, listing the known names, when the name is unknown.
const Option& find_option(std::string_view name);

/// Checks the name and the options.
std::unique_ptr<LinearSolver> make_solver(std::string_view name, const SolverOptions& options = {});

}  // namespace linkwise
