#include "linkwise/solve/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "linkwise/base/error.hpp"
#include "linkwise/linear/vector.hpp"

namespace linkwise {
namespace {

/// Number of eigenvalues below x of the symmetric tridiagonal matrix (Sturm sequence).
int count_below(std::span<const double> d, std::span<const double> e, double x) {
  int below = 0;
  double pivot = 1.0;
  for (std::size_t k = 0; k < d.size(); ++k) {
    const double square = k > 0 ? e[k - 1] * e[k - 1] : 0.0;
    pivot = d[k] - x - (k > 0 ? square / pivot : 0.0);
    if (pivot == 0.0) pivot = std::numeric_limits<double>::min();
    if (pivot < 0.0) ++below;
  }
  return below;
}

/// The eigenvalue with `below` smaller ones, by bisection to full relative accuracy.
double tridiagonal_eigenvalue(std::span<const double> d, std::span<const double> e, int below,
                              double low, double high) {
  for (int step = 0; step < 200 && high - low > 1e-12 * std::abs(high); ++step) {
    const double middle = 0.5 * (low + high);
    (count_below(d, e, middle) <= below ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

/// Extreme eigenvalues of the matrix of a Lanczos process into `result`.
void take_extremes(std::span<const double> d, std::span<const double> e, Spectrum& result) {
  double bound = 0.0;  // of Gershgorin's discs
  for (std::size_t k = 0; k < d.size(); ++k)
    bound =
        std::max(bound, std::abs(d[k]) + (k < e.size() ? e[k] : 0.0) + (k > 0 ? e[k - 1] : 0.0));
  result.smallest = tridiagonal_eigenvalue(d, e, 0, -bound, bound);
  result.largest = tridiagonal_eigenvalue(d, e, static_cast<int>(d.size()) - 1, -bound, bound);
}

/// With a share of every mode, the same on every call.
void set_start(std::span<double> v) {
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i] = 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i));
}

}  // namespace

double Spectrum::radius() const { return std::max(1.0 - smallest, largest - 1.0); }

double optimal_relaxation(double smallest_eigenvalue) {
  // 1 - mu^2 = lambda (2 - lambda)
  const double lambda = std::clamp(smallest_eigenvalue, 0.0, 1.0);
  return 2.0 / (1.0 + std::sqrt(lambda * (2.0 - lambda)));
}

Spectrum SpectrumEstimator::estimate(const ScaledTree& system, const SpectrumOptions& options) {
  const int size = system.size();
  const std::size_t n = static_cast<std::size_t>(size);
  Spectrum result;
  if (size == 0) return result;
  const int usual = std::min(2 * size + 50, 2000);
  const int limit = options.max_steps > 0 ? options.max_steps : usual;
  for (std::vector<double>* v : {&v_, &previous_, &w_}) v->resize(n);
  diagonal_.clear();
  off_diagonal_.clear();
  diagonal_.reserve(std::min(limit, usual));
  off_diagonal_.reserve(std::min(limit, usual));
  set_start(v_);
  const double length = std::sqrt(sum_of_squares(v_));
  for (double& value : v_) value /= length;
  std::fill(previous_.begin(), previous_.end(), 0.0);

  double beta = 0.0;
  int next_check = 4;
  result.converged = false;
  double before = std::numeric_limits<double>::infinity();
  for (int step = 1; step <= limit; ++step) {
    system.multiply(v_, w_);
    const double alpha = dot(v_, w_);
    for (std::size_t i = 0; i < n; ++i) w_[i] -= alpha * v_[i] + beta * previous_[i];
    diagonal_.push_back(alpha);
    beta = std::sqrt(sum_of_squares(w_));
    result.steps = step;
    const bool exhausted = beta <= 1e-14 || step == limit;
    if (step == next_check || exhausted) {
      take_extremes(diagonal_, off_diagonal_, result);
      result.converged = beta <= 1e-14 || std::abs(before - result.smallest) <=
                                              options.tolerance * std::abs(result.smallest);
      if (result.converged || exhausted) return result;
      before = result.smallest;
      next_check = step + step / 2 + 1;
    }
    off_diagonal_.push_back(beta);
    for (std::size_t i = 0; i < n; ++i) {
      previous_[i] = v_[i];
      v_[i] = w_[i] / beta;
    }
  }
  return result;
}

Spectrum estimate_spectrum(const BlockGraph& A, const KnotJacobi& P,
                           const SpectrumOptions& options) {
  // Conjugate gradients on some right-hand side are a Lanczos process [golub2013, section 11.3].
  const std::size_t n = static_cast<std::size_t>(A.size());
  const int limit = options.max_steps > 0 ? options.max_steps : std::min(2 * A.size() + 50, 2000);
  const Executor executor;
  std::vector<double> r(n), z(n), p(n), q(n), motions, diagonal, off_diagonal;
  Spectrum result;
  if (n == 0) return result;
  set_start(r);
  P.solve(A, r, z, executor);
  double rz = dot(r, z), growth = 0.0, last_step = 1.0;
  const double first = rz;
  double before = std::numeric_limits<double>::infinity();
  int next_check = 4;
  result.converged = false;
  for (int step = 1; step <= limit; ++step) {
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + growth * p[i];
    A.multiply(p, q, motions);
    const double alpha = rz / dot(p, q);
    diagonal.push_back(1 / alpha + growth / last_step);
    last_step = alpha;
    for (std::size_t i = 0; i < n; ++i) r[i] -= alpha * q[i];
    P.solve(A, r, z, executor);
    const double next = dot(r, z);
    growth = next / rz;
    rz = next;
    result.steps = step;
    const bool exhausted = !(rz > 1e-24 * first) || step == limit;
    if (step == next_check || exhausted) {
      take_extremes(diagonal, off_diagonal, result);
      result.converged = rz <= 1e-24 * first ||
                         std::abs(before - result.smallest) <= options.tolerance * result.smallest;
      if (result.converged || exhausted) break;
      before = result.smallest;
      next_check = step + step / 2 + 1;
    }
    off_diagonal.push_back(std::sqrt(growth) / alpha);
  }
  return result;
}

Spectrum estimate_spectrum(const BlockTree& A, const SpectrumOptions& options) {
  ScaledTree scaled;
  if (!scaled.prepare(A))
    throw InputError("spectrum: the matrix is not positive definite at node " +
                     std::to_string(scaled.failed_node()));
  return SpectrumEstimator().estimate(scaled, options);
}

}  // namespace linkwise
