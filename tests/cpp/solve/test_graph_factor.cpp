// Systems of graphs, against one dense matrix.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/linear/semidefinite.hpp"
#include "linkwise/solve/direct/graph_factor.hpp"
#include "linkwise/solve/iterative/graph_conjugate_gradient.hpp"
#include "linkwise/solve/spectrum.hpp"

namespace linkwise::testing {
namespace {

/// Nodes of 0 to 6 rows on one to three of some hubs, of which some are wide. singular: every third
/// node is one before it once more, and no hub is wide.
BlockGraph random_graph(int nodes, int hubs, bool singular, Draws& draws) {
  std::vector<char> is_wide(hubs);
  for (char& wide : is_wide) wide = !singular && draws.below(3) == 0;
  std::vector<int> dims;
  std::vector<std::vector<int>> of_node;
  for (int i = 0; i < nodes; ++i) {
    dims.push_back(draws.below(7));
    of_node.push_back({i % hubs});
    for (int more = draws.below(3); more > 0; --more) {
      const int k = draws.below(hubs);
      if (std::find(of_node.back().begin(), of_node.back().end(), k) == of_node.back().end())
        of_node.back().push_back(k);
    }
    if (singular && i % 3 == 2) {
      dims[i] = dims[i - 2];
      of_node[i] = of_node[i - 2];
    }
  }
  BlockGraph A;
  A.set_structure(dims, of_node, is_wide);
  for (double& x : A.levers) x = draws.normal();
  for (int hub = 0; hub < A.n_hubs(); ++hub) {
    const int w = A.width(hub);
    double root[144], *const C = A.compliance(hub);
    for (int i = 0; i < w * w; ++i) root[i] = draws.normal();
    for (int i = 0; i < w; ++i)
      for (int j = 0; j < w; ++j) {
        C[w * i + j] = i == j;
        for (int k = 0; k < w; ++k) C[w * i + j] += root[w * i + k] * root[w * j + k];
      }
  }
  for (int i = 0; i < nodes; ++i) {
    for (int r = 0; r < dims[i] && !singular; ++r)
      if (draws.below(2)) A.own[A.offset[i] + r] = draws.uniform(0.1, 1);
    if (!singular || i % 3 != 2) continue;
    for (size_t which = 0; which < of_node[i].size(); ++which)
      for (int r = 0; r < dims[i]; ++r)
        std::copy_n(A.lever(i - 2, static_cast<int>(which), r), 6,
                    A.lever(i, static_cast<int>(which), r));
  }
  return A;
}

/// A, by its product; and L^-1 A L^-T with D_A = L L^T.
struct Dense {
  int n;
  std::vector<double> A, scaled;
  std::vector<double> L;  ///< [n][n]

  explicit Dense(const BlockGraph& graph) : n(graph.size()) {
    const auto size = static_cast<size_t>(n);
    A.resize(size * size);
    L.resize(size * size);
    std::vector<double> unit(size), column(size), room;
    for (int j = 0; j < n; ++j) {
      unit[j] = 1;
      graph.multiply(unit, column, room);
      unit[j] = 0;
      for (int i = 0; i < n; ++i) A[i * size + j] = column[i];
    }
    for (int node = 0; node < graph.n(); ++node)
      for (int i = graph.offset[node]; i < graph.offset[node + 1]; ++i)
        for (int j = graph.offset[node]; j <= i; ++j) {
          double x = A[i * size + j];
          for (int k = graph.offset[node]; k < j; ++k) x -= L[i * size + k] * L[j * size + k];
          L[i * size + j] = i == j ? std::sqrt(x) : x / L[j * size + j];
        }
    scaled = A;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) column[i] = scaled[i * size + j];
      forward(column);
      for (int i = 0; i < n; ++i) scaled[i * size + j] = column[i];
    }
    for (int i = 0; i < n; ++i) {
      std::copy_n(&scaled[i * size], n, column.begin());
      forward(column);
      std::copy_n(column.begin(), n, &scaled[i * size]);
    }
  }
  void forward(std::vector<double>& x) const {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < i; ++j) x[i] -= L[static_cast<size_t>(i) * n + j] * x[j];
      x[i] /= L[static_cast<size_t>(i) * n + i];
    }
  }
  void backward(std::vector<double>& x) const {
    for (int i = n; i-- > 0;) {
      for (int j = i + 1; j < n; ++j) x[i] -= L[static_cast<size_t>(j) * n + i] * x[j];
      x[i] /= L[static_cast<size_t>(i) * n + i];
    }
  }
  /// Of all solutions the one of least x^T D_A x; the number of null vectors.
  std::vector<double> least(std::vector<double> b, int& nulls) const {
    SemidefiniteFactor factor;
    factor.factor(n, scaled.data(), 1e-10);
    nulls = n - factor.rank();
    forward(b);
    factor.solve(b.data(), b.data());
    backward(b);
    return b;
  }
};

double largest(const std::vector<double>& x) {
  double size = 0;
  for (const double xi : x) size = std::max(size, std::abs(xi));
  return size;
}

TEST(GraphFactor, SolvesAsOneDenseMatrix) {
  for (int sample = 0; sample < 40; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(sample);
    const bool singular = sample % 2;
    const int nodes = 1 + draws.below(40);
    const BlockGraph A = random_graph(nodes, 1 + draws.below(nodes), singular, draws);
    const Dense dense(A);
    std::vector<double> any(A.size()), b(A.size()), x(A.size()), room;
    for (double& xi : any) xi = draws.normal();
    A.multiply(any, b, room);
    int nulls = 0;
    const std::vector<double> want = dense.least(b, nulls);
    GraphFactor factor(A);
    ASSERT_EQ(factor.factor(A, 1e-10, true), -1);
    EXPECT_EQ(factor.n_null(), nulls);
    const double asked = std::max(1.0, largest(b));
    for (const bool least : {false, true}) {
      EXPECT_LT(factor.solve(A, b, x, least), 1e-10 * asked);
      std::vector<double> back(A.size());
      A.multiply(x, back, room);
      for (int i = 0; i < A.size(); ++i) EXPECT_NEAR(back[i], b[i], 1e-9 * asked);
    }
    for (int i = 0; i < A.size(); ++i)
      EXPECT_NEAR(x[i], want[i], 1e-6 * std::max(1.0, largest(want))) << i;
    SolverOptions options;
    options.tolerance = 1e-10;
    GraphConjugateGradient iteration(options);
    const Report report = iteration.solve(A, b, x);
    ASSERT_TRUE(report.ok()) << to_string(report.outcome) << " at " << report.error_estimate;
    // Whole knots are another norm.
    const bool is_wide = A.motion_begin.back() > 6 * A.n_hubs();
    std::vector<double> back(A.size());
    A.multiply(x, back, room);
    for (int i = 0; i < A.size(); ++i) {
      EXPECT_NEAR(back[i], b[i], 1e-6 * asked) << i;
      if (is_wide && nulls > 0) continue;
      EXPECT_NEAR(x[i], want[i], 1e-6 * std::max(1.0, largest(want))) << i;
    }
  }
}

// A body that the ground holds twice repeats rows, and is then no knot.
TEST(KnotJacobi, TakesBodiesThatAreHeldTwice) {
  Draws draws(7);
  BlockGraph A;
  A.set_structure(std::vector<int>{3, 5, 5}, std::vector<std::vector<int>>{{0, 1}, {1}, {1}},
                  {1, 0});
  for (double& x : A.levers) x = draws.normal();
  for (int hub = 0; hub < 2; ++hub)
    for (int i = 0; i < A.width(hub); ++i) A.compliance(hub)[(A.width(hub) + 1) * i] = 1;
  std::vector<double> any(A.size()), b(A.size()), x(A.size()), back(A.size()), room;
  for (double& xi : any) xi = draws.normal();
  A.multiply(any, b, room);
  SolverOptions options;
  options.tolerance = 1e-10;
  ASSERT_TRUE(GraphConjugateGradient(options).solve(A, b, x).ok());
  A.multiply(x, back, room);
  for (int i = 0; i < A.size(); ++i) EXPECT_NEAR(back[i], b[i], 1e-8 * largest(b));
}

/// Wide hubs in a row, each with a joint at either end; a knot between two of them where `knots`,
/// the first of which is held where `held`.
BlockGraph chain_of_wide_hubs(int n, bool knots, bool held, Draws& draws) {
  std::vector<int> dims;
  std::vector<std::vector<int>> of_node;
  const int step = knots ? 2 : 1;
  std::vector<char> is_wide(step * n);
  for (int i = 0; i < n; ++i) is_wide[step * i] = 1;
  for (int hub = 0; hub < step * n; ++hub) {
    dims.push_back(1 + draws.below(3));
    of_node.push_back({hub});
    if (hub > 0) of_node.back().push_back(hub - 1);
  }
  if (held) {
    dims.push_back(3);
    of_node.push_back({1});
  }
  BlockGraph A;
  A.set_structure(dims, of_node, is_wide);
  for (double& x : A.levers) x = draws.normal();
  for (int hub = 0; hub < A.n_hubs(); ++hub) {
    const int w = A.width(hub);
    double* const C = A.compliance(hub);
    for (int i = 0; i < w; ++i) C[(w + 1) * i] = draws.uniform(0.5, 2);
  }
  return A;
}

// Column by column, against P put together from what each body adds.
TEST(KnotJacobi, SolvesWhatItsBodiesAddUpTo) {
  for (const int kind : {0, 1, 2}) {
    Draws draws(11);
    const BlockGraph A = chain_of_wide_hubs(6, kind > 0, kind == 2, draws);
    KnotJacobi jacobi;
    ASSERT_EQ(jacobi.factor(A), -1);
    const auto n = static_cast<size_t>(A.size());
    std::vector<double> P(n * n), unit(n), column(n), room;
    for (int hub = 0; hub < A.n_hubs(); ++hub) {
      BlockGraph alone = A;
      for (int other = 0; other < A.n_hubs(); ++other)
        if (const int w = A.width(other); other != hub)
          std::fill_n(alone.compliance(other), w * w, 0.0);
      for (int node = 0; node < A.n(); ++node)
        for (int j = A.offset[node]; j < A.offset[node + 1]; ++j) {
          unit[j] = 1;
          alone.multiply(unit, column, room);
          unit[j] = 0;
          const bool whole = A.width(hub) == 6;
          for (size_t i = 0; i < n; ++i)
            if (whole ||
                (static_cast<int>(i) >= A.offset[node] && static_cast<int>(i) < A.offset[node + 1]))
              P[i * n + j] += column[i];
        }
    }
    for (size_t j = 0; j < n; ++j) {
      unit[j] = 1;
      jacobi.solve(A, unit, column, Executor());
      unit[j] = 0;
      for (size_t i = 0; i < n; ++i) {
        double back = 0;
        for (size_t k = 0; k < n; ++k) back += P[i * n + k] * column[k];
        EXPECT_NEAR(back, i == j, 1e-10);
      }
    }
  }
}

TEST(KnotJacobi, BoundsTheSpectrum) {
  for (int sample = 0; sample < 12; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(sample);
    const BlockGraph A = chain_of_wide_hubs(12, sample % 3 > 0, sample % 3 == 2, draws);
    KnotJacobi P;
    ASSERT_EQ(P.factor(A), -1);
    const KnotJacobi::Bound bound = P.bound(A);
    const Spectrum found = estimate_spectrum(A, P);
    EXPECT_GT(bound.smallest, 0);
    EXPECT_GE(found.smallest, bound.smallest * (1 - 1e-9));
    EXPECT_LE(found.largest, bound.largest * (1 + 1e-9));
    EXPECT_LE(found.largest, 2);
    std::vector<double> b(A.size()), x(A.size());
    for (double& bi : b) bi = draws.normal();
    SolverOptions options;
    options.tolerance = 1e-7;
    const Report report = GraphConjugateGradient(options).solve(A, b, x);
    ASSERT_TRUE(report.ok());
    EXPECT_LE(report.iterations, bound.iterations(options.tolerance));
  }
}

// Six motions cannot hold ten rows apart.
TEST(KnotJacobi, HasNoBoundForRigidChains) {
  BlockGraph A;
  A.set_structure(std::vector<int>{5, 5}, std::vector<std::vector<int>>{{0}, {0, 1}});
  Draws draws(5);
  for (double& x : A.levers) x = draws.normal();
  for (int hub = 0; hub < 2; ++hub)
    for (int i = 0; i < 6; ++i) A.compliance(hub)[7 * i] = 1;
  KnotJacobi P;
  ASSERT_EQ(P.factor(A), -1);
  EXPECT_EQ(P.bound(A).smallest, 0);
  EXPECT_TRUE(std::isinf(P.bound(A).iterations(1e-7)));
}

TEST(GraphFactor, SaysByHowMuchRowsContradictEachOther) {
  Draws draws(3);
  const BlockGraph A = random_graph(9, 4, true, draws);
  std::vector<double> b(A.size()), x(A.size());
  for (double& bi : b) bi = draws.normal();
  GraphFactor factor(A);
  ASSERT_EQ(factor.factor(A, 1e-10, false), -1);
  ASSERT_GT(factor.n_null(), 0);
  EXPECT_GT(factor.solve(A, b, x, false), 1e-3);
}

// What stands before a front has been eliminated, and every row once.
TEST(EliminationOrder, TakesEveryNodeOnceAndChildrenFirst) {
  for (int sample = 0; sample < 40; ++sample) {
    SCOPED_TRACE(sample);
    Draws draws(100 + sample);
    const int nodes = 1 + draws.below(60);
    const BlockGraph A = random_graph(nodes, 1 + draws.below(nodes), false, draws);
    std::vector<int> seen(A.n()), hubs(A.n_hubs());
    const std::vector<Front> fronts = elimination_order(A);
    for (int f = 0; f < static_cast<int>(fronts.size()); ++f) {
      for (const int i : fronts[f].rest) EXPECT_EQ(seen[i], 0);
      for (const int i : fronts[f].pivots) ++seen[i];
      for (const int k : fronts[f].hubs) ++hubs[k];
      for (const int child : fronts[f].children) {
        EXPECT_LT(child, f);
        for (const int i : fronts[child].rest) {
          const auto among = [&](const std::vector<int>& list) {
            return std::find(list.begin(), list.end(), i) != list.end();
          };
          EXPECT_TRUE(among(fronts[f].pivots) || among(fronts[f].rest));
        }
      }
    }
    for (int i = 0; i < A.n(); ++i) EXPECT_EQ(seen[i], A.dim(i) > 0);
    for (int k = 0; k < A.n_hubs(); ++k) EXPECT_LE(hubs[k], 1);
  }
}

// A tree fills in nothing, whatever the order of its nodes: the work of a chain grows as its
// length.
TEST(EliminationOrder, ChainsAndRingsAreLinear) {
  const auto work = [](int n, bool ring) {
    std::vector<int> dims(n, 5);
    std::vector<std::vector<int>> hubs;
    for (int i = 0; i < n; ++i) {
      hubs.push_back({(7 * i) % n});
      if (i > 0 || ring) hubs.back().push_back((7 * i + n - 1) % n);
    }
    BlockGraph A;
    A.set_structure(dims, hubs);
    return work_of(A, elimination_order(A));
  };
  for (const bool ring : {false, true}) EXPECT_LT(work(1000, ring), 11 * work(100, ring));
}

}  // namespace
}  // namespace linkwise::testing
