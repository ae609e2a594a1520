// The cut system of a chain in pieces is the Schur complement of a forest with a border: the joints
// inside the pieces are the forest, the cut joints the border.
#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/constraint/tree_system.hpp"
#include "linkwise/solve/registry.hpp"
#include "solve/bordered_solver.hpp"

namespace linkwise::testing {
namespace {

/// The system of a chain with every `length`th joint, the first one included, in the border.
struct CutChain {
  BorderedSystem A;
  std::vector<double> b;
  std::vector<int> place;  ///< of each row of the chain's own system

  CutChain(const BlockTree& chain, const std::vector<double>& chain_b, int length) {
    const auto is_cut = [&](int node) { return node % length == 0; };
    std::vector<int> node_of(chain.n(), -1), parent, dim;
    for (int i = 0; i < chain.n(); ++i) {
      if (is_cut(i)) continue;
      node_of[i] = static_cast<int>(dim.size());
      parent.push_back(is_cut(i - 1) ? -1 : node_of[i - 1]);
      dim.push_back(chain.dim[i]);
    }
    A.forest.set_structure(parent, dim);
    for (int i = 0; i < chain.n(); ++i) {
      if (is_cut(i)) continue;
      A.forest.diag[node_of[i]] = chain.diag[i];
      if (!is_cut(i - 1)) A.forest.parent_block[node_of[i]] = chain.parent_block[i];
    }
    std::vector<std::vector<int>> nodes;
    for (int i = 0; i < chain.n(); i += length)
      for (int r = 0; r < chain.dim[i]; ++r) {
        nodes.emplace_back();
        for (const int neighbour : {i - 1, i + 1})
          if (neighbour >= 0 && neighbour < chain.n()) nodes.back().push_back(node_of[neighbour]);
      }
    A.set_border(nodes);
    place.resize(chain.size());
    b.resize(chain.size());
    int row = 0;
    for (int i = 0; i < chain.n(); ++i)
      for (int r = 0; r < chain.dim[i]; ++r)
        place[chain.offset[i] + r] =
            is_cut(i) ? A.forest.size() + row++ : A.forest.offset[node_of[i]] + r;
    for (size_t k = 0; k < place.size(); ++k) b[place[k]] = chain_b[k];
    couple(chain, node_of, length);
  }

 private:
  void couple(const BlockTree& chain, const std::vector<int>& node_of, int length) {
    for (int i = 0; i < chain.n(); i += length)
      for (int r = 0; r < chain.dim[i]; ++r) {
        const int k = place[chain.offset[i] + r] - A.forest.size();
        for (int c = 0; c < chain.dim[i]; ++c)
          A.corner[A.width() * k + k - r + c] = chain.diag[i][block_stride * r + c];
        for (BorderedSystem::Coupling& to : A.border[k])
          for (int c = 0; c < A.forest.dim[to.node]; ++c)
            to.row[c] = i > 0 && to.node == node_of[i - 1]
                            ? chain.parent_block[i][block_stride * r + c]
                            : chain.parent_block[i + 1][block_stride * c + r];
      }
  }
};

class PiecewiseBorder : public ::testing::TestWithParam<int> {};

TEST_P(PiecewiseBorder, CutForcesAreThoseOfTheBorder) {
  const int n = GetParam();
  Draws draws(60 + n);
  const Model model(tree_spec(std::vector(n, JointType::revolute), chain_parents(n), draws));
  const DynamicsCase c(model, 3);
  Piecewise method(model, {});
  const Motion6 pieces = evaluate(method, model, c.input());

  TreeSystem system(model);
  system.assemble(c.input());
  const int length = (n + Piecewise::pieces(n) - 1) / Piecewise::pieces(n);
  const CutChain cut(system.A(), system.b(), length);
  std::vector<double> x(cut.b.size()), f(cut.b.size());
  BorderedSolver solver(make_solver("thomas"));
  ASSERT_TRUE(solver.solve(cut.A, cut.b, x).ok());
  for (size_t k = 0; k < f.size(); ++k) f[k] = x[cut.place[k]];

  // Pieces of stand-ins at the end of the chain have cuts of their own, with nothing to carry.
  const auto all = method.constraint_force();
  ASSERT_GE(all.size(), static_cast<size_t>(cut.A.width()));
  expect_close({all.begin(), all.begin() + cut.A.width()},
               {x.begin() + cut.A.forest.size(), x.end()}, 1e-9, "cut forces");
  Motion6 border{std::vector<double>(n), std::vector<double>(6 * n)};
  system.recover(c.input(), f, border.du.data(), border.loads.data());
  expect_close(pieces.du, border.du, 1e-9, "accelerations");
  expect_close(pieces.loads, border.loads, 1e-9, "loads");
}

INSTANTIATE_TEST_SUITE_P(Lengths, PiecewiseBorder, ::testing::Values(16, 20, 33, 64, 100, 257));

}  // namespace
}  // namespace linkwise::testing
