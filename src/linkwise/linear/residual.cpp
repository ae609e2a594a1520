// Residual by error-free transformations [ogita2005]: every product and sum is carried as an
// unevaluated pair high + low. Slow (some ten times a plain product), for refinement only.

#include "linkwise/linear/residual.hpp"

#include <cmath>
#include <vector>

namespace linkwise {
namespace {

struct Pair {
  double high = 0.0, low = 0.0;

  void add(double value) {
    const double sum = high + value;
    const double part = sum - high;
    low += (high - (sum - part)) + (value - part);
    high = sum;
  }
  /// += a b
  void add_product(double a, double b) {
    const double product = a * b;
    low += std::fma(a, b, -product);
    add(product);
  }
  /// += a (b.high + b.low)
  void add_product(double a, const Pair& b) {
    add_product(a, b.high);
    low += a * b.low;
  }
  double rounded() const { return high + low; }
};

/// y += sign B x with B rows x cols.
template <class X>
void multiply_add(const Block& block, int rows, int cols, const X* x, Pair* y, double sign) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) y[i].add_product(sign * block[6 * i + j], x[j]);
}

/// y += sign B^T x.
template <class X>
void transpose_multiply_add(const Block& block, int rows, int cols, const X* x, Pair* y,
                            double sign) {
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) y[j].add_product(sign * block[6 * i + j], x[i]);
}

/// The couplings of a hub, as in BlockTree::multiply, subtracted from r.
void subtract_hub(const BlockTree& A, const BlockTree::Hub& body, const double* x, Pair* r) {
  const int p = body.node;
  Pair all[6], through[6];
  for (int i : body.children)
    transpose_multiply_add(A.levers[A.lever_of[i]], A.dim[i], 6, x + A.offset[i], all, 1.0);
  multiply_add(body.compliance, 6, 6, all, through, 1.0);
  multiply_add(body.inboard, A.dim[p], 6, through, r + A.offset[p], 1.0);
  transpose_multiply_add(body.inboard, A.dim[p], 6, x + A.offset[p], all, -1.0);
  for (int i : body.children) {
    const Block& lever = A.levers[A.lever_of[i]];
    Pair others[6] = {all[0], all[1], all[2], all[3], all[4], all[5]}, response[6];
    transpose_multiply_add(lever, A.dim[i], 6, x + A.offset[i], others, -1.0);
    multiply_add(body.compliance, 6, 6, others, response, 1.0);
    multiply_add(lever, A.dim[i], 6, response, r + A.offset[i], -1.0);
  }
}

}  // namespace

void accurate_residual(const BlockTree& A, std::span<const double> b, std::span<const double> x,
                       std::span<double> r) {
  static thread_local std::vector<Pair> sums;
  sums.assign(r.size(), Pair{});
  for (std::size_t k = 0; k < r.size(); ++k) sums[k].high = b[k];
  for (int i = 0; i < A.n(); ++i) {
    const int at = A.offset[i];
    multiply_add(A.diag[i], A.dim[i], A.dim[i], x.data() + at, sums.data() + at, -1.0);
    const int p = A.lever_of[i] < 0 ? A.parent[i] : -1;
    if (p < 0) continue;
    const int to = A.offset[p];
    multiply_add(A.parent_block[i], A.dim[i], A.dim[p], x.data() + to, sums.data() + at, -1.0);
    transpose_multiply_add(A.parent_block[i], A.dim[i], A.dim[p], x.data() + at, sums.data() + to,
                           -1.0);
  }
  for (const BlockTree::Hub& body : A.hubs) subtract_hub(A, body, x.data(), sums.data());
  for (std::size_t k = 0; k < r.size(); ++k) r[k] = sums[k].rounded();
}

}  // namespace linkwise
