#include "linkwise/solve/direct/graph_factor.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "linkwise/base/memory.hpp"
#include "linkwise/base/packed.hpp"
#include "linkwise/simd/cholesky.hpp"

namespace linkwise {
namespace {

/// So far above rounding that noise along null vectors stays below 1e-8 of a solution.
constexpr double shift = 1e-7;
constexpr int most_steps = 12;
/// Columns of a panel, which the rest of a front is changed by at once.
constexpr int panel_width = 8;

int rows_of(const BlockGraph& graph, const std::vector<int>& nodes) {
  return std::accumulate(nodes.begin(), nodes.end(), 0,
                         [&](int sum, int i) { return sum + graph.dim(i); });
}

/// y -= columns of a panel times their factors, rows [begin, end).
template <int width>
void subtract_columns(double* __restrict y, const double* __restrict panel, std::size_t stride,
                      const double* factors, int begin, int end) {
#pragma GCC ivdep
  for (int i = begin; i < end; ++i) {
    double sum = 0;
#pragma GCC unroll 8
    for (int k = 0; k < width; ++k) sum += panel[k * stride + i] * factors[k];
    y[i] -= sum;
  }
}

/// Eliminates the first `pivots` columns of a symmetric matrix, lower triangle, column-major.
/// inverse: 1 / D, 0 of rows that are left out.
void eliminate(double* F, int rows, int pivots, double null, double* inverse) {
  const auto column = [&](int j) { return F + static_cast<std::size_t>(j) * rows; };
  for (int begin = 0; begin < pivots; begin += panel_width) {
    const int end = std::min(begin + panel_width, pivots);
    double d[panel_width], factors[panel_width];
    for (int k = begin; k < end; ++k) {
      double* const own = column(k);
      for (int j = begin; j < k; ++j) {
        factors[0] = d[j - begin] * column(j)[k];
        subtract_columns<1>(own, column(j), 0, factors, k, rows);
      }
      const double pivot = own[k];
      const bool counts = pivot > null;
      inverse[k] = counts ? 1 / pivot : 0.0;
      d[k - begin] = counts ? pivot : 0.0;
      own[k] = counts || !std::isnan(pivot) ? 1 : pivot;
      for (int i = k + 1; i < rows; ++i) own[i] *= inverse[k];
    }
    for (int j = end; j < rows; ++j) {
      for (int k = begin; k < end; ++k) factors[k - begin] = d[k - begin] * column(k)[j];
      if (end - begin == panel_width) {
        subtract_columns<panel_width>(column(j), column(begin), rows, factors, j, rows);
      } else {
        for (int k = begin; k < end; ++k)
          subtract_columns<1>(column(j), column(k), 0, factors + k - begin, j, rows);
      }
    }
  }
}

}  // namespace

double work_of(const BlockGraph& graph, const std::vector<Front>& fronts) {
  double work = 0;
  for (const Front& front : fronts) {
    const double p = rows_of(graph, front.pivots), r = rows_of(graph, front.rest);
    work += p * r * r / 2 + p * p * r / 2 + p * p * p / 6 + (p + r) * (p + r);
  }
  return work;
}

GraphFactor::GraphFactor(const BlockGraph& structure) {
  const std::vector<Front> fronts = elimination_order(structure);
  lay_out(structure, fronts);
  const double bytes = 8.0 * (static_cast<double>(panels_) + static_cast<double>(deepest_) +
                              static_cast<double>(largest_) * largest_);
  if (bytes > worth_a_check)
    require_memory(bytes, "the factor of a system of " + std::to_string(structure.size()) +
                              " joint constraint forces");
  const auto size = static_cast<std::size_t>(structure.size());
  L_.resize(panels_);
  inverse_.resize(size);
  front_.resize(static_cast<std::size_t>(largest_) * largest_);
  stack_.resize(deepest_);
  scaling_.resize(21 * static_cast<std::size_t>(structure.n()));
  for (auto* x : {&x_, &left_, &more_, &given_}) x->resize(size);
}

void GraphFactor::lay_out(const BlockGraph& structure, const std::vector<Front>& fronts) {
  offset_ = structure.offset;
  place_.assign(structure.n(), 0);
  int at = 0;
  for (const Front& front : fronts)
    for (const int i : front.pivots) {
      place_[i] = at;
      order_.push_back(i);
      at += structure.dim(i);
    }
  std::vector<std::size_t> left(fronts.size());
  std::size_t depth = 0;
  for (const Front& front : fronts) {
    Step step{};
    step.pivots = rows_of(structure, front.pivots);
    step.rows = step.pivots + rows_of(structure, front.rest);
    step.begin = front.pivots.empty() ? 0 : place_[front.pivots.front()];
    step.rest = rest_.size();
    for (const int i : front.rest)
      for (int r = 0; r < structure.dim(i); ++r) rest_.push_back(place_[i] + r);
    std::sort(rest_.begin() + static_cast<std::ptrdiff_t>(step.rest), rest_.end());
    step.panel = panels_;
    panels_ += static_cast<std::size_t>(step.rows) * step.pivots;
    step.first_hub = static_cast<int>(hubs_.size());
    hubs_.insert(hubs_.end(), front.hubs.begin(), front.hubs.end());
    step.last_hub = static_cast<int>(hubs_.size());
    step.first_child = static_cast<int>(children_.size());
    children_.insert(children_.end(), front.children.begin(), front.children.end());
    step.last_child = static_cast<int>(children_.size());
    largest_ = std::max(largest_, step.rows);
    const std::size_t rest = step.rows - step.pivots;
    for (const int child : front.children) depth -= left[child];
    depth += left[steps_.size()] = rest * rest;
    deepest_ = std::max(deepest_, depth);
    steps_.push_back(step);
  }
  map_.resize(rest_.size());
  for (const Step& parent : steps_)
    for (int c = parent.first_child; c < parent.last_child; ++c) {
      Step& child = steps_[children_[c]];
      child.map = child.rest;
      const int* const rest = rest_.data() + parent.rest;
      for (int i = 0; i < child.rows - child.pivots; ++i) {
        const int row = rest_[child.rest + i];
        map_[child.map + i] =
            row < parent.begin + parent.pivots
                ? row - parent.begin
                : parent.pivots +
                      static_cast<int>(
                          std::lower_bound(rest, rest + parent.rows - parent.pivots, row) - rest);
      }
    }
}

/// Factors of D_A. A row that holds nothing at all counts as one of length 1.
bool GraphFactor::scale_nodes(const BlockGraph& A) {
  for (int i = 0; i < A.n(); ++i) {
    double* const L = &scaling_[21 * static_cast<std::size_t>(i)];
    A.calc_diagonal(i, L);
    if (A.dim(i) == 1 && L[0] == 0) L[0] = 1;
    if (!cholesky_factor(A.dim(i), L, 0.0)) {
      failed_ = i;
      return false;
    }
  }
  return true;
}

double GraphFactor::scale(int node, int row) const {
  return scaling_[21 * static_cast<std::size_t>(node) + packed(row, row)];
}

int GraphFactor::factor(const BlockGraph& A, double null, bool least) {
  failed_ = -1;
  if (!scale_nodes(A)) return failed_;
  factor_fronts(A, null, 0.0, L_, inverse_);
  n_null_ = 0;
  double largest = 0;
  for (const double x : inverse_) {
    n_null_ += x == 0;
    largest = std::max(largest, x);
  }
  smallest_ = largest > 0 ? 1 / largest : 1;
  if (least && n_null_ > 0) {
    shifted_L_.resize(L_.size());
    shifted_inverse_.resize(inverse_.size());
    factor_fronts(A, 0.1 * shift, shift, shifted_L_, shifted_inverse_);
  }
  return failed_;
}

/// H C H^T of the ends of a hub, where D_A is 1.
void GraphFactor::add_hub(const BlockGraph& A, int hub, const Step& step) {
  with_width(A.width(hub), [&](auto width) { add_hub(A, hub, step, width); });
}

template <int w>
void GraphFactor::add_hub(const BlockGraph& A, int hub, const Step& step,
                          std::integral_constant<int, w>) {
  levers_.clear();
  local_.clear();
  const int* const rest = rest_.data() + step.rest;
  for (int e = A.hub_begin[hub]; e < A.hub_begin[hub + 1]; ++e) {
    const int node = A.end_node[e], rows = A.dim(node), place = place_[node];
    const double* const L = &scaling_[21 * static_cast<std::size_t>(node)];
    const std::size_t first = levers_.size();
    levers_.insert(levers_.end(), A.levers.begin() + static_cast<std::ptrdiff_t>(A.lever_begin[e]),
                   A.levers.begin() + static_cast<std::ptrdiff_t>(A.lever_begin[e] + w * rows));
    double* const H = levers_.data() + first;
    for (int r = 0; r < rows; ++r) {
      for (int l = 0; l < r; ++l)
        for (int c = 0; c < w; ++c) H[w * r + c] -= L[packed(r, l)] * H[w * l + c];
      for (int c = 0; c < w; ++c) H[w * r + c] *= L[packed(r, r)];
    }
    const int local =
        place < step.begin + step.pivots
            ? place - step.begin
            : step.pivots +
                  static_cast<int>(std::lower_bound(rest, rest + step.rows - step.pivots, place) -
                                   rest);
    for (int r = 0; r < rows; ++r) local_.push_back(local + r);
  }
  const double* const C = A.compliance(hub);
  const std::size_t n = local_.size();
  for (std::size_t j = 0; j < n; ++j) {
    double y[w] = {};
    for (int r = 0; r < w; ++r)
      for (int c = 0; c < w; ++c) y[r] += C[w * r + c] * levers_[w * j + c];
    for (std::size_t i = 0; i < n; ++i) {
      if (local_[i] < local_[j]) continue;
      double sum = 0;
      for (int c = 0; c < w; ++c) sum += levers_[w * i + c] * y[c];
      front_[static_cast<std::size_t>(local_[j]) * step.rows + local_[i]] += sum;
    }
  }
}

/// E where D_A is 1, and `more`, on the diagonal from place p on.
void GraphFactor::add_own(const BlockGraph& A, int node, int p, int n, double more) {
  const int rows = A.dim(node);
  const double* const own = A.own.data() + A.offset[node];
  const double* const L = &scaling_[21 * static_cast<std::size_t>(node)];
  for (int k = 0; k < rows; ++k) {
    front_[static_cast<std::size_t>(p + k) * (n + 1)] += more;
    if (own[k] == 0) continue;
    double x[6] = {};  // L^-1 times unit vector k
    for (int i = k; i < rows; ++i) {
      x[i] = i == k;
      for (int l = k; l < i; ++l) x[i] -= L[packed(i, l)] * x[l];
      x[i] *= L[packed(i, i)];
    }
    for (int j = k; j < rows; ++j)
      for (int i = j; i < rows; ++i)
        front_[static_cast<std::size_t>(p + j) * n + p + i] += own[k] * x[i] * x[j];
  }
}

void GraphFactor::factor_fronts(const BlockGraph& A, double null, double more,
                                std::vector<double>& L, std::vector<double>& inverse) {
  std::size_t top = 0, next_node = 0;
  for (const Step& step : steps_) {
    const std::size_t n = step.rows;
    std::fill_n(front_.begin(), n * n, 0.0);
    for (int h = step.first_hub; h < step.last_hub; ++h) add_hub(A, hubs_[h], step);
    for (int c = step.last_child; c-- > step.first_child;) {
      const Step& child = steps_[children_[c]];
      const std::size_t m = child.rows - child.pivots;
      top -= m * m;
      const int* const to = map_.data() + child.map;
      for (std::size_t j = 0; j < m; ++j) {
        double* const column = front_.data() + static_cast<std::size_t>(to[j]) * n;
        const double* const from = stack_.data() + top + j * m;
        for (std::size_t i = j; i < m; ++i) column[to[i]] += from[i];
      }
    }
    for (int p = 0; p < step.pivots;) {
      const int node = order_[next_node++];
      add_own(A, node, p, step.rows, more);
      p += A.dim(node);
    }
    eliminate(front_.data(), step.rows, step.pivots, null, inverse.data() + step.begin);
    std::copy_n(front_.data(), n * step.pivots, L.data() + step.panel);
    const std::size_t m = n - step.pivots;
    for (std::size_t j = 0; j < m; ++j)
      std::copy_n(front_.data() + (step.pivots + j) * n + step.pivots + j, m - j,
                  stack_.data() + top + j * m + j);
    top += m * m;
  }
}

void GraphFactor::solve_once(const std::vector<double>& L, const std::vector<double>& inverse,
                             double* x) {
  for (const Step& step : steps_) {
    const int* const rest = rest_.data() + step.rest;
    double* const own = x + step.begin;
    for (int k = 0; k < step.pivots; ++k) {
      const double* const column = L.data() + step.panel + std::size_t(k) * step.rows;
      const double xk = own[k];
      for (int i = k + 1; i < step.pivots; ++i) own[i] -= column[i] * xk;
      for (int i = step.pivots; i < step.rows; ++i) x[rest[i - step.pivots]] -= column[i] * xk;
    }
  }
  for (std::size_t i = 0; i < inverse.size(); ++i) x[i] *= inverse[i];
  for (std::size_t s = steps_.size(); s-- > 0;) {
    const Step& step = steps_[s];
    const int* const rest = rest_.data() + step.rest;
    double* const own = x + step.begin;
    for (int k = step.pivots; k-- > 0;) {
      const double* const column = L.data() + step.panel + std::size_t(k) * step.rows;
      double sum = own[k];
      for (int i = k + 1; i < step.pivots; ++i) sum -= column[i] * own[i];
      for (int i = step.pivots; i < step.rows; ++i) sum -= column[i] * x[rest[i - step.pivots]];
      own[k] = inverse[step.begin + k] == 0 ? 0 : sum;
    }
  }
}

/// x <- L^-1 b, D_A = L L^T, in elimination order.
void GraphFactor::to_scaled(const double* b, double* x) const {
  for (const int node : order_) {
    const double* const L = &scaling_[21 * static_cast<std::size_t>(node)];
    const double* const from = b + offset_[node];
    double* const to = x + place_[node];
    for (int i = 0; i < offset_[node + 1] - offset_[node]; ++i) {
      to[i] = from[i];
      for (int l = 0; l < i; ++l) to[i] -= L[packed(i, l)] * to[l];
      to[i] *= L[packed(i, i)];
    }
  }
}

/// out <- L^-T x.
void GraphFactor::from_scaled(const double* x, double* out) const {
  for (const int node : order_) {
    const double* const L = &scaling_[21 * static_cast<std::size_t>(node)];
    const double* const from = x + place_[node];
    double* const to = out + offset_[node];
    const int rows = offset_[node + 1] - offset_[node];
    for (int i = rows; i-- > 0;) {
      to[i] = from[i];
      for (int l = i + 1; l < rows; ++l) to[i] -= L[packed(l, i)] * to[l];
      to[i] *= L[packed(i, i)];
    }
  }
}

/// What x leaves of b into left_, where D_A is 1; the largest of it.
double GraphFactor::miss(const BlockGraph& A, const std::vector<double>& x) {
  product_.resize(x.size());
  A.multiply(x, product_, motions_);
  for (std::size_t i = 0; i < x.size(); ++i) product_[i] = given_[i] - product_[i];
  to_scaled(product_.data(), left_.data());
  double largest = 0;
  for (const double r : left_) largest = std::max(largest, std::abs(r));
  return largest;
}

/// x += what a factor makes of left_.
void GraphFactor::add_answer(const std::vector<double>& L, const std::vector<double>& inverse,
                             std::vector<double>& x) {
  solve_once(L, inverse, left_.data());
  from_scaled(left_.data(), more_.data());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += more_[i];
}

double GraphFactor::solve(const BlockGraph& A, std::span<const double> b, std::span<double> x,
                          bool least) {
  given_.assign(b.begin(), b.end());
  x_.assign(b.size(), 0.0);
  double missed = miss(A, x_);
  // A step leaves the part shift / (l + shift) of the error along an eigenvector of eigenvalue l,
  // and adds nothing where l is zero.
  for (int step = 0; least && n_null_ > 0 && step < most_steps && missed > 0; ++step) {
    last_ = x_;
    add_answer(shifted_L_, shifted_inverse_, x_);
    const double now = miss(A, x_);
    if (!(now < 0.5 * missed)) {  // rounding errors are all that is left
      if (!(now < missed)) {
        x_ = last_;
        missed = miss(A, x_);
      }
      break;
    }
    missed = now;
  }
  for (int twice = 0; twice < 2; ++twice) {
    add_answer(L_, inverse_, x_);
    missed = miss(A, x_);
  }
  std::copy(x_.begin(), x_.end(), x.begin());
  return missed;
}

}  // namespace linkwise
