#include "linkwise/solve/registry.hpp"

#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/solve/direct/cyclic_reduction.hpp"
#include "linkwise/solve/direct/thomas.hpp"
#include "linkwise/solve/direct/twisted.hpp"
#include "linkwise/solve/iterative/block_schwarz_conjugate_gradient.hpp"
#include "linkwise/solve/iterative/chebyshev.hpp"
#include "linkwise/solve/iterative/conjugate_gradient.hpp"
#include "linkwise/solve/iterative/gauss_seidel.hpp"
#include "linkwise/solve/iterative/jacobi.hpp"
#include "linkwise/solve/iterative/lagged_thomas.hpp"
#include "linkwise/solve/iterative/red_black_gauss_seidel.hpp"
#include "linkwise/solve/iterative/red_black_sor.hpp"
#include "linkwise/solve/iterative/rs_conjugate_gradient.hpp"
#include "linkwise/solve/iterative/sor.hpp"
#include "linkwise/solve/iterative/symmetric_stair_conjugate_gradient.hpp"
#include "linkwise/solve/iterative/two_level.hpp"

namespace linkwise {
namespace {

using enum SolverKind;

// name, description, kind, chains only, parallel, reference
constexpr SolverEntry table[] = {
    {"thomas", "block elimination, leaf to root, hubs in linear time", direct, false, false,
     "golub2013", make_thomas},
    {"twisted", "block elimination from both ends of a chain", direct, true, false, "babuska1972",
     make_twisted},
    {"cyclic_reduction", "block elimination of every second node, log2 N times", direct, true, true,
     "heller1976", make_cyclic_reduction},
    {"conjugate_gradient", "conjugate gradients, preconditioned by the block diagonal (J-CG)",
     iterative, false, true, "sharf1993", make_conjugate_gradient},
    {"jacobi", "block Jacobi", iterative, false, true, "sharf1993", make_jacobi},
    {"gauss_seidel", "block Gauss-Seidel, base to tip", iterative, false, false, "sharf1993",
     make_gauss_seidel},
    {"sor", "block successive over-relaxation, base to tip", iterative, false, false, "sharf1993",
     make_sor},
    {"chebyshev", "Chebyshev acceleration of block Jacobi (J-SI)", iterative, false, true,
     "sharf1993", make_chebyshev},
    {"red_black_gauss_seidel", "block Gauss-Seidel, every second node at once", iterative, false,
     true, "hageman1981", make_red_black_gauss_seidel},
    {"red_black_sor", "block successive over-relaxation, every second node at once", iterative,
     false, true, "hageman1981", make_red_black_sor},
    {"rs_conjugate_gradient", "conjugate gradients with every second node eliminated (RS-CG)",
     iterative, false, true, "hageman1981", make_rs_conjugate_gradient},
    {"symmetric_stair_conjugate_gradient", "conjugate gradients, symmetric stair preconditioner",
     iterative, false, true, "bu2024", make_symmetric_stair_conjugate_gradient},
    {"block_schwarz_conjugate_gradient",
     "conjugate gradients, exact solves on pieces of block_size joints", iterative, false, true,
     "smith1996", make_block_schwarz_conjugate_gradient},
    {"two_level",
     "conjugate gradients, exact solves on pieces and a coarse space of their coupling", iterative,
     false, true, "tang2009", make_two_level},
    {"lagged_thomas", "conjugate gradients, preconditioned by the factor of an earlier system",
     iterative, false, false, "golub2013", make_lagged_thomas},
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

std::unique_ptr<LinearSolver> make_solver(std::string_view name, const SolverOptions& options) {
  const SolverEntry& entry = find_solver(name);
  validate(options);
  return entry.make(options);
}

}  // namespace linkwise
