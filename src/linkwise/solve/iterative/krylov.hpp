#pragma once
// Preconditioned conjugate gradients, two-term [hestenes1952], for any operator and preconditioner;
// and the smallest eigenvalue that they have seen.

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "linkwise/linear/vector.hpp"
#include "linkwise/solve/stop_test.hpp"

namespace linkwise {

/// Estimate of the smallest eigenvalue of the preconditioned matrix from the coefficients of
/// conjugate gradients, by incremental condition estimation [bischof1990] of the bidiagonal
/// Cholesky factor of the Lanczos matrix: a dozen operations per iteration, as in [meurant2019].
class SmallestRitz {
 public:
  /// step: alpha_k of this iteration; growth: beta of the previous one.
  void add(double step, double growth) {
    const double diagonal = 1.0 / std::sqrt(step);
    if (norm_squared_ == 0.0) {
      last_ = 1.0 / diagonal;
      norm_squared_ = last_ * last_;
    } else {
      // L has the new row (..., sqrt(growth / previous step), diagonal). With the solution y of
      // L y = d, |d| = 1, extended to d+ = (s d, c): maximise |y+|^2 = [s c] G [s c]^T.
      const double coupled = std::sqrt(growth / previous_step_) * last_;
      const double inverse = 1.0 / (diagonal * diagonal);
      const double g11 = norm_squared_ + coupled * coupled * inverse;
      const double g12 = -coupled * inverse;
      const double mean = 0.5 * (g11 + inverse), half = 0.5 * (g11 - inverse);
      const double largest = mean + std::sqrt(half * half + g12 * g12);
      double s = largest - inverse, c = g12;
      const double length = std::sqrt(s * s + c * c);
      s = length > 0.0 ? s / length : 1.0;
      c = length > 0.0 ? c / length : 0.0;
      last_ = (c - s * coupled) / diagonal;
      norm_squared_ = largest;
    }
    previous_step_ = step;
  }
  double value() const { return norm_squared_ > 0.0 ? 1.0 / norm_squared_ : 1.0; }

 private:
  double norm_squared_ = 0.0, last_ = 0.0, previous_step_ = 1.0;
};

/// Why conjugate gradients cannot go on: the residual is at rounding level, the matrix or its
/// preconditioner is not positive definite, or numbers have overflowed.
inline Outcome breakdown(double rz, double curvature, double first_rz) {
  if (!std::isfinite(rz) || !std::isfinite(curvature)) return Outcome::not_finite;
  return std::abs(rz) <= 1e-28 * std::abs(first_rz) ? Outcome::converged
                                                    : Outcome::not_positive_definite;
}

struct KrylovVectors {
  std::vector<double> r, z, p, q;
  void resize(std::size_t size) {
    for (std::vector<double>* v : {&r, &z, &p, &q}) v->resize(size);
  }
};

/// multiply(v, w): w = A v. precondition(r, z): z = M^-1 r, or returns r itself for M = 1.
/// other_energy: what the part of the solution that x leaves out adds to ||x*||_A^2.
/// residual_is_known: work.r holds b - A x already.
/// The bound on the error is (z, r)^2 / (p, M p) over the smallest eigenvalue [meurant2019].
template <class Multiply, class Precondition>
void conjugate_gradients(std::span<const double> b, std::span<double> x, StopTest& stop,
                         KrylovVectors& work, Multiply&& multiply, Precondition&& precondition,
                         const Executor& executor, double other_energy = 0.0,
                         bool residual_is_known = false) {
  work.resize(x.size());
  std::span<double> r = work.r, p = work.p, q = work.q;
  if (!residual_is_known) {
    multiply(std::span<const double>(x), r);
    subtract_from(b, r, executor);
  }
  // ||x*||^2 - ||x* - x0||^2 = x0^T (b + r0)  [strakos2002]
  double known_energy = dot(x, b, executor) + dot(x, r, executor);
  if (known_energy < 0.0) {
    // Zero is closer to the solution than the guess, whose rounding errors would remain.
    std::fill(x.begin(), x.end(), 0.0);
    std::copy(b.begin(), b.end(), r.begin());
    known_energy = 0.0;
  }
  known_energy += other_energy;
  stop.set_solution_energy(known_energy);
  std::span<const double> z = precondition(std::span<const double>(r), std::span<double>(work.z));
  double rz = dot(r, z, executor), growth = 0.0;
  const double first_rz = rz;
  if (stop.accepts_start(rz)) return;
  double share = 1.0;  // (z, r) / (p, M p)
  SmallestRitz ritz;
  bool first = true;
  while (true) {
    if (rz == 0.0) return stop.stop(Outcome::converged);
    if (first)
      std::copy(z.begin(), z.end(), p.begin());
    else
      for_each_entry(p.size(), executor, [&](std::size_t i) { p[i] = z[i] + growth * p[i]; });
    first = false;
    multiply(std::span<const double>(p), q);
    const double curvature = dot(p, q, executor);
    if (!(curvature > 0.0) || !(rz > 0.0)) return stop.stop(breakdown(rz, curvature, first_rz));
    const double step = rz / curvature;
    for_each_entry(x.size(), executor, [&](std::size_t i) {
      x[i] += step * p[i];
      r[i] -= step * q[i];
    });
    ritz.add(step, growth);
    stop.set_smallest_eigenvalue(ritz.value());
    const double decrease = step * rz;
    const double energy = known_energy + stop.estimate().total() + decrease;
    z = precondition(std::span<const double>(r), std::span<double>(work.z));
    const double next = dot(r, z, executor);
    growth = next / rz;
    rz = next;
    share /= share + growth;
    const double bound = std::abs(rz) * share / stop.smallest_eigenvalue();
    if (stop.stops({.decrease = decrease,
                    .solution_energy = energy,
                    .squared_bound = bound,
                    .x = x,
                    .change = p,
                    .factor = step,
                    .residual = r}))
      return;
  }
}

}  // namespace linkwise
