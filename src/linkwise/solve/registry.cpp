#include "linkwise/solve/registry.hpp"

#include <algorithm>
#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/solve/initial_guess.hpp"

namespace linkwise {

// Each in the file of its name, but for the relaxations, all in sor.cpp, and the pieces, in
// two_level.cpp.
using MakeSolver = std::unique_ptr<LinearSolver>(const SolverOptions&);
MakeSolver make_thomas, make_twisted, make_cyclic_reduction, make_conjugate_gradient, make_jacobi,
    make_gauss_seidel, make_sor, make_chebyshev, make_red_black_gauss_seidel, make_red_black_sor,
    make_rs_conjugate_gradient, make_symmetric_stair_conjugate_gradient,
    make_block_schwarz_conjugate_gradient, make_two_level, make_lagged_thomas;
OptionList direct_options, conjugate_gradient_options, sor_options, red_black_sor_options,
    chebyshev_options, pieces_options, lagged_thomas_options;

namespace {

using enum SolverKind;

// name, description, kind, chains only, loops, parallel, reference, factory, own options
constexpr SolverEntry table[] = {
    {"thomas",
     "block elimination, leaf to root, hubs in linear time; of closed loops by least degree",
     direct, false, true, false, "golub2013", make_thomas, direct_options},
    {"twisted", "block elimination from both ends of a chain", direct, true, false, false,
     "babuska1972", make_twisted, direct_options},
    {"cyclic_reduction", "block elimination of every second node, log2 N times", direct, true,
     false, true, "heller1976", make_cyclic_reduction, direct_options},
    {"conjugate_gradient", "conjugate gradients, preconditioned by the block diagonal (J-CG)",
     iterative, false, true, true, "sharf1993", make_conjugate_gradient,
     conjugate_gradient_options},
    {"jacobi", "block Jacobi", iterative, false, false, true, "sharf1993", make_jacobi},
    {"gauss_seidel", "block Gauss-Seidel, base to tip", iterative, false, false, false, "sharf1993",
     make_gauss_seidel},
    {"sor", "block successive over-relaxation, base to tip", iterative, false, false, false,
     "sharf1993", make_sor, sor_options},
    {"chebyshev", "Chebyshev acceleration of block Jacobi (J-SI)", iterative, false, false, true,
     "sharf1993", make_chebyshev, chebyshev_options},
    {"red_black_gauss_seidel", "block Gauss-Seidel, every second node at once", iterative, false,
     false, true, "hageman1981", make_red_black_gauss_seidel},
    {"red_black_sor", "block successive over-relaxation, every second node at once", iterative,
     false, false, true, "hageman1981", make_red_black_sor, red_black_sor_options},
    {"rs_conjugate_gradient", "conjugate gradients with every second node eliminated (RS-CG)",
     iterative, false, false, true, "hageman1981", make_rs_conjugate_gradient},
    {"symmetric_stair_conjugate_gradient", "conjugate gradients, symmetric stair preconditioner",
     iterative, false, false, true, "bu2024", make_symmetric_stair_conjugate_gradient},
    {"block_schwarz_conjugate_gradient",
     "conjugate gradients, exact solves on pieces of block_size joints", iterative, false, false,
     true, "smith1996", make_block_schwarz_conjugate_gradient, pieces_options},
    {"two_level",
     "conjugate gradients, exact solves on pieces and a coarse space of their coupling", iterative,
     false, false, true, "tang2009", make_two_level, pieces_options},
    {"lagged_thomas", "conjugate gradients, preconditioned by the factor of an earlier system",
     iterative, false, false, false, "golub2013", make_lagged_thomas, lagged_thomas_options},
};

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

std::vector<SolverOption> solver_options() {
  std::vector<SolverOption> all;
  const auto add = [&](std::string_view owner, std::span<const Option> options) {
    for (const Option& option : options) {
      const auto same = [&](const SolverOption& o) { return o.option->name == option.name; };
      const auto at = std::find_if(all.begin(), all.end(), same);
      if (at == all.end())
        all.push_back({&option, std::string(owner)});
      else
        at->owners += ", " + std::string(owner);
    }
  };
  add("", common_options());
  for (const SolverEntry& entry : table) add(entry.name, entry.options());
  for (const InitialGuessEntry& entry : initial_guess_table())
    add("initial guess " + std::string(entry.name), entry.options());
  return all;
}

const Option& find_option(std::string_view name) {
  std::string known;
  for (const SolverOption& each : solver_options()) {
    if (each.option->name == name) return *each.option;
    known += (known.empty() ? "" : ", ") + std::string(each.option->name);
  }
  throw InputError("solver_options: unknown key '" + std::string(name) + "'; known: " + known);
}

std::unique_ptr<LinearSolver> make_solver(std::string_view name, const SolverOptions& options) {
  const SolverEntry& entry = find_solver(name);
  validate(options);
  return entry.make(options);
}

}  // namespace linkwise
