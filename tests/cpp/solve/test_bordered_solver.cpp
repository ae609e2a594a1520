// Forests with a border against the dense twin: random borders of every width, loops of bodies,
// and borders that depend on themselves.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "linear/block_tree_scenes.hpp"
#include "linear/dense_twin.hpp"
#include "linkwise/solve/registry.hpp"
#include "solve/bordered_solver.hpp"

namespace linkwise::testing {
namespace {

Dense bordered_twin(const BorderedSystem& A) {
  const Dense forest = dense_twin(A.forest);
  Dense all;
  all.size = A.size();
  all.a.assign(static_cast<std::size_t>(all.size) * all.size, 0.0);
  const int n = forest.size, m = A.width();
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) all.at(i, j) = forest.at(i, j);
  for (int k = 0; k < m; ++k) {
    for (const BorderedSystem::Coupling& c : A.border[k])
      for (int r = 0; r < A.forest.dim[c.node]; ++r)
        all.at(n + k, A.forest.offset[c.node] + r) = all.at(A.forest.offset[c.node] + r, n + k) +=
            c.row[r];
    for (int l = 0; l < m; ++l)
      all.at(n + k, n + l) = A.corner[static_cast<std::size_t>(m) * k + l];
  }
  return all;
}

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  long double sum = 0.0L;
  for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<long double>(a[i]) * b[i];
  return static_cast<double>(sum);
}

/// A random border whose Schur complement is M M^T, M width x rank, to rounding.
BorderedSystem random_border(Shape shape, int n, int width, int rank, std::uint64_t seed) {
  BorderedSystem A;
  A.forest = random_tree(shape, Dims::mixed, n, seed);
  std::mt19937_64 random(seed + 1);
  std::vector<std::vector<int>> nodes(width);
  for (std::vector<int>& row : nodes)
    for (int i = 0; i < n; ++i)
      if (random() % 4 == 0) row.push_back(i);
  A.set_border(nodes);
  const Dense forest = dense_twin(A.forest);
  const std::vector<double> numbers = random_vector(36 * width * n + width * rank, seed + 2);
  std::vector<std::vector<double>> rows, responses;
  auto next = numbers.begin() + width * rank;
  for (int k = 0; k < width; ++k) {
    for (BorderedSystem::Coupling& c : A.border[k])
      for (double& value : c.row) value = *next++;
    rows.emplace_back(A.forest.size(), 0.0);
    A.add_border_row(k, 1.0, rows.back());
    responses.push_back(cholesky_solve(forest, rows.back()));
  }
  for (int k = 0; k < width; ++k)
    for (int l = 0; l < width; ++l) {
      double& entry = A.corner[width * k + l] =
          dot(rows[std::max(k, l)], responses[std::min(k, l)]);
      for (int r = 0; r < rank; ++r) entry += numbers[rank * k + r] * numbers[rank * l + r];
    }
  return A;
}

class Borders : public ::testing::TestWithParam<int> {};

TEST_P(Borders, ProductAndSolutionEqualTheDenseTwins) {
  for (Shape shape : {Shape::chain, Shape::star, Shape::random_tree, Shape::bushy_tree}) {
    SCOPED_TRACE(name_of(shape, Dims::mixed, 15));
    const int width = GetParam();
    const BorderedSystem A = random_border(shape, 15, width, width + 3, 10 + width);
    const Dense dense = bordered_twin(A);
    const std::vector<double> b = random_vector(A.size(), 3);
    std::vector<double> product(A.size());
    A.multiply(b, product);
    const std::vector<double> wanted = multiply(dense, b);
    for (int i = 0; i < A.size(); ++i)
      EXPECT_NEAR(product[i], wanted[i], 1e-11 * (1.0 + std::abs(wanted[i])));
    const std::vector<double> exact = cholesky_solve(dense, b);
    ASSERT_FALSE(exact.empty());
    for (const char* name : {"thomas", "conjugate_gradient", "two_level"}) {
      SolverOptions options;
      options.tolerance = 1e-12;
      BorderedSolver solver(make_solver(name, options));
      std::vector<double> x(A.size(), 0.0), again(A.size(), 0.0);
      const Report report = solver.solve(A, b, x);
      ASSERT_TRUE(report.ok()) << name << ' ' << to_string(report.outcome);
      EXPECT_LT(energy_error(dense, x, exact), 1e-8) << name;
      solver.solve(A, b, again);
      if (std::string(name) == "thomas") {
        EXPECT_EQ(again, x);
      }
    }
  }
}

TEST_P(Borders, RowsThatDependAreReportedAndLeftOut) {
  const int width = GetParam(), rank = width / 2;
  if (width < 2) return;
  const BorderedSystem A = random_border(Shape::random_tree, 15, width, rank, 20 + width);
  // b in the range of A, as the motion of an over-constrained mechanism has it.
  const std::vector<double> some = random_vector(A.size(), 3);
  std::vector<double> b(A.size()), x(A.size(), 0.0), image(A.size());
  A.multiply(some, b);
  BorderedSolver solver(make_solver("thomas"));
  const Report report = solver.solve(A, b, x);
  EXPECT_EQ(report.outcome, Outcome::not_positive_definite);
  EXPECT_EQ(report.node, A.forest.n() + rank);
  for (int k = 0; k < width; ++k) {
    EXPECT_EQ(solver.depends(k), k >= rank) << k;
    if (k >= rank) {
      EXPECT_EQ(x[A.forest.size() + k], 0.0);
    }
  }
  A.multiply(x, image);
  for (int i = 0; i < A.size(); ++i) EXPECT_NEAR(image[i], b[i], 1e-7 * (1.0 + std::abs(b[i])));
}

INSTANTIATE_TEST_SUITE_P(Widths, Borders, ::testing::Range(0, 13));

// Bodies on a tree with one more joint that closes a loop between two of them: A = B C B^T, the
// rows of B being the joints' directions on the two bodies that they connect.
TEST(Loops, TheJointThatClosesALoopIsABorder) {
  constexpr int n = 12, rows = 5, first = 4, second = 11;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const bool chain : {true, false}) {
    std::vector<Joint> joints(n);
    for (int i = 0; i < n; ++i) {
      Joint& joint = joints[i];
      joint.parent = i == 0 ? -1 : chain ? i - 1 : (i - 1) / 2;
      joint.dim = rows;
      Matrix6 root;
      for (double& value : root) value = 0.5 * normal(random);
      for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 6; ++c) {
          for (int k = 0; k < 6; ++k)
            joint.compliance[6 * r + c] += root[6 * r + k] * root[6 * c + k];
          if (r == c) joint.compliance[6 * r + c] += 0.2;
        }
      for (double& value : joint.directions) value = normal(random);
      for (double& value : joint.shift) value = normal(random);
    }
    const std::vector<double> loop = random_vector(72, 7);
    // Row blocks of B, per body: of the tree's joints, then of the loop's.
    const auto directions = [&](int joint, int body) {
      Block out{};
      if (joint == n) {
        if (body == first || body == second)
          std::copy_n(loop.begin() + (body == first ? 0 : 36), 6 * rows, out.begin());
      } else if (body == joint) {
        out = joints[joint].directions;
      } else if (body == joints[joint].parent) {
        for (int r = 0; r < rows; ++r)
          for (int c = 0; c < 6; ++c)
            for (int k = 0; k < 6; ++k)
              out[6 * r + c] -=
                  joints[joint].directions[6 * r + k] * joints[joint].shift[6 * k + c];
      }
      return out;
    };
    const auto coupling = [&](int i, int j) {
      Block out{};
      for (int body = 0; body < n; ++body) {
        const Block term =
            through_body(directions(i, body), joints[body].compliance, directions(j, body), 1.0);
        for (int k = 0; k < 36; ++k) out[k] += term[k];
      }
      return out;
    };
    BorderedSystem A;
    A.forest = assemble(joints);
    std::vector<int> touched;  // joints at one of the loop's bodies
    for (int i = 0; i < n; ++i)
      for (int body : {first, second})
        if ((i == body || joints[i].parent == body) && (touched.empty() || touched.back() != i))
          touched.push_back(i);
    EXPECT_LE(touched.size(), 6u);
    A.set_border(std::vector<std::vector<int>>(rows, touched));
    for (int k = 0; k < rows; ++k) {
      for (BorderedSystem::Coupling& c : A.border[k])
        for (int r = 0; r < rows; ++r) c.row[r] = coupling(n, c.node)[6 * k + r];
      for (int l = 0; l < rows; ++l) A.corner[rows * k + l] = coupling(n, n)[6 * k + l];
    }
    Dense dense;
    dense.size = A.size();
    dense.a.assign(static_cast<std::size_t>(dense.size) * dense.size, 0.0);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        const Block block = coupling(i, j);
        for (int r = 0; r < rows; ++r)
          for (int c = 0; c < rows; ++c) dense.at(rows * i + r, rows * j + c) = block[6 * r + c];
      }
    const std::vector<double> b = random_vector(A.size(), 6), exact = cholesky_solve(dense, b);
    ASSERT_FALSE(exact.empty());
    std::vector<double> x(A.size(), 0.0);
    BorderedSolver solver(make_solver("thomas"));
    const Report report = solver.solve(A, b, x);
    ASSERT_TRUE(report.ok()) << to_string(report.outcome);
    EXPECT_LT(energy_error(dense, x, exact), 1e-10);
  }
}

}  // namespace
}  // namespace linkwise::testing
