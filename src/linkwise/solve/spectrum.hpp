#pragma once
// Extreme eigenvalues of the block-Jacobi-scaled system A~ = 1 + O by the Lanczos process, and what
// follows from them: condition number, spectral radius of Jacobi's iteration, optimal relaxation.

#include <span>
#include <vector>

#include "linkwise/linear/scaled_tree.hpp"
#include "linkwise/solve/iterative/knot_jacobi.hpp"
#include "linkwise/solve/options.hpp"

namespace linkwise {

struct SpectrumOptions {
  /// Stop when another half of the steps changes the smallest eigenvalue by less than this.
  double tolerance = 1e-3;
  /// 0: twice the number of unknowns plus 50, at most 2000.
  int max_steps = 0;
};

struct Spectrum {
  double smallest = 1.0, largest = 1.0;  ///< of D^-1 A
  int steps = 0;
  bool converged = true;

  double condition() const { return largest / smallest; }
  /// Of Jacobi's iteration matrix 1 - D^-1 A.
  double radius() const;
};

/// 2 / (1 + sqrt(1 - mu^2)), mu = 1 - smallest eigenvalue of D^-1 A [hageman1981, chapter 9],
/// written so that no digits cancel when mu is near 1.
double optimal_relaxation(double smallest_eigenvalue);

/// Of the solvers that need an eigenvalue.
inline constexpr Option spectral_radius_option{
    .name = "spectral_radius",
    .fallback = 0.0,
    .text = "of 1 - D^-1 A, in (0, 1); 0: estimated",
    .accepts = [](double x) { return x >= 0.0 && x < 1.0; },
    .wanted = "give a number in (0, 1), or 0 to have it estimated"};

/// Keeps its memory between calls.
class SpectrumEstimator {
 public:
  Spectrum estimate(const ScaledTree& system, const SpectrumOptions& options = {});

 private:
  std::vector<double> v_, previous_, w_;
  std::vector<double> diagonal_, off_diagonal_;
};

/// Of P^-1 A, P factored.
Spectrum estimate_spectrum(const BlockGraph& A, const KnotJacobi& P,
                           const SpectrumOptions& options = {});

/// Scales A and estimates.
Spectrum estimate_spectrum(const BlockTree& A, const SpectrumOptions& options = {});

}  // namespace linkwise
