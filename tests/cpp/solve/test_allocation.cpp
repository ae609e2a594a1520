// No solver allocates after its first solve of a structure. Counted with this program's own
// operator new, which all of its tests run with; not under a sanitizer, which brings its own.

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linkwise/solve/initial_guess.hpp"
#include "linkwise/solve/registry.hpp"

namespace {
thread_local long allocations = 0;
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size ? size : 1)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace linkwise::testing {
namespace {

TEST(Allocation, IsCounted) {
  const long before = allocations;
  const auto solver = make_solver("thomas");
  EXPECT_GT(allocations - before, 0);
}

TEST(Allocation, NoneAfterTheFirstSolve) {
  for (const SolverEntry& entry : solver_table())
    for (Shape shape : {Shape::chain, Shape::bushy_tree}) {
      BlockTree tree = random_tree(shape, Dims::mixed, 150, 3);
      if (entry.chains_only && !tree.hubs.empty()) continue;
      const std::vector<double> b = random_vector(tree.size(), 1);
      std::vector<double> x(b.size(), 0.0);
      SolverOptions options;
      options.tolerance = 1e-4;
      options.set("estimate_error", true);
      options.max_iterations = 500;
      const auto solver = entry.make(options);
      solver->solve(tree, b, x);
      const long before = allocations;
      for (int step = 0; step < 3; ++step) {
        for (int i = 0; i < tree.n(); ++i)
          for (int k = 0; k < tree.dim[i]; ++k) tree.diag[i][7 * k] *= 1.001;
        std::fill(x.begin(), x.end(), 0.0);
        solver->solve(tree, b, x);
      }
      EXPECT_EQ(allocations - before, 0) << entry.name << ' ' << name_of(shape, Dims::mixed, 150);
    }
}

TEST(Allocation, NoneInAGuessOnceItsHistoryIsFull) {
  const BlockTree tree = random_tree(Shape::bushy_tree, Dims::mixed, 20, 3);
  const std::vector<double> b = random_vector(tree.size(), 1);
  std::vector<double> x(b.size());
  SolverOptions options;
  options.set("history", 4);
  for (const InitialGuessEntry& entry : initial_guess_table()) {
    const auto guess = entry.make(options.own);
    long before = 0;
    for (int step = 0; step < 12; ++step) {
      if (step == 6) before = allocations;
      guess->predict(0.1 * step, tree, b, x);
      for (int i = 0; i < tree.size(); ++i) x[i] = b[i] + 0.01 * step * i;
      guess->solved(0.1 * step, x);
      guess->accept(0.1 * step, x);
    }
    EXPECT_EQ(allocations - before, 0) << entry.name;
  }
}

}  // namespace
}  // namespace linkwise::testing

#endif
