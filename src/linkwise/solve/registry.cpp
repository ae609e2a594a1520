#include "linkwise/solve/registry.hpp"

#include <algorithm>
#include <string>

#include "linkwise/base/named.hpp"
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

constexpr SolverEntry table[] = {
    {.name = "thomas",
     .description =
         "block elimination, leaf to root, hubs in linear time; of closed loops by least degree",
     .kind = direct,
     .reference = "golub2013",
     .takes_loops = true,
     .make = make_thomas,
     .options = direct_options},
    {.name = "twisted",
     .description = "block elimination from both ends of a chain",
     .kind = direct,
     .reference = "babuska1972",
     .chains_only = true,
     .make = make_twisted,
     .options = direct_options},
    {.name = "cyclic_reduction",
     .description = "block elimination of every second node, log2 N times",
     .kind = direct,
     .reference = "heller1976",
     .chains_only = true,
     .parallel = true,
     .make = make_cyclic_reduction,
     .options = direct_options},
    {.name = "conjugate_gradient",
     .description = "conjugate gradients, preconditioned by the block diagonal (J-CG)",
     .kind = iterative,
     .reference = "sharf1993",
     .takes_loops = true,
     .parallel = true,
     .make = make_conjugate_gradient,
     .options = conjugate_gradient_options},
    {.name = "jacobi",
     .description = "block Jacobi",
     .kind = iterative,
     .reference = "sharf1993",
     .parallel = true,
     .make = make_jacobi},
    {.name = "gauss_seidel",
     .description = "block Gauss-Seidel, base to tip",
     .kind = iterative,
     .reference = "sharf1993",
     .make = make_gauss_seidel},
    {.name = "sor",
     .description = "block successive over-relaxation, base to tip",
     .kind = iterative,
     .reference = "sharf1993",
     .make = make_sor,
     .options = sor_options},
    {.name = "chebyshev",
     .description = "Chebyshev acceleration of block Jacobi (J-SI)",
     .kind = iterative,
     .reference = "sharf1993",
     .parallel = true,
     .make = make_chebyshev,
     .options = chebyshev_options},
    {.name = "red_black_gauss_seidel",
     .description = "block Gauss-Seidel, every second node at once",
     .kind = iterative,
     .reference = "hageman1981",
     .parallel = true,
     .make = make_red_black_gauss_seidel},
    {.name = "red_black_sor",
     .description = "block successive over-relaxation, every second node at once",
     .kind = iterative,
     .reference = "hageman1981",
     .parallel = true,
     .make = make_red_black_sor,
     .options = red_black_sor_options},
    {.name = "rs_conjugate_gradient",
     .description = "conjugate gradients with every second node eliminated (RS-CG)",
     .kind = iterative,
     .reference = "hageman1981",
     .parallel = true,
     .make = make_rs_conjugate_gradient},
    {.name = "symmetric_stair_conjugate_gradient",
     .description = "conjugate gradients, symmetric stair preconditioner",
     .kind = iterative,
     .reference = "bu2024",
     .parallel = true,
     .make = make_symmetric_stair_conjugate_gradient},
    {.name = "block_schwarz_conjugate_gradient",
     .description = "conjugate gradients, exact solves on pieces of block_size joints",
     .kind = iterative,
     .reference = "smith1996",
     .parallel = true,
     .make = make_block_schwarz_conjugate_gradient,
     .options = pieces_options},
    {.name = "two_level",
     .description =
         "conjugate gradients, exact solves on pieces and a coarse space of their coupling",
     .kind = iterative,
     .reference = "tang2009",
     .parallel = true,
     .make = make_two_level,
     .options = pieces_options},
    {.name = "lagged_thomas",
     .description = "conjugate gradients, preconditioned by the factor of an earlier system",
     .kind = iterative,
     .reference = "golub2013",
     .make = make_lagged_thomas,
     .options = lagged_thomas_options},
};

}  // namespace

std::string_view to_string(SolverKind kind) {
  return kind == SolverKind::direct ? "direct" : "iterative";
}

std::span<const SolverEntry> solver_table() { return table; }

const SolverEntry& find_solver(std::string_view name) { return find_named("solver", name, table); }

std::vector<SolverOption> solver_options() {
  std::vector<SolverOption> all;
  const auto add = [&](std::string_view owner, std::span<const Option> options) {
    for (const Option& option : options) {
      const auto same = [&](const SolverOption& o) { return o.name == option.name; };
      const auto at = std::find_if(all.begin(), all.end(), same);
      if (at == all.end())
        all.push_back({option.name, &option, std::string(owner)});
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
  return *find_named("solver_options: key", name, solver_options()).option;
}

std::unique_ptr<LinearSolver> make_solver(std::string_view name, const SolverOptions& options) {
  const SolverEntry& entry = find_solver(name);
  validate(options);
  return entry.make(options);
}

}  // namespace linkwise
