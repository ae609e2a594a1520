#pragma once
// Block successive over-relaxation, eq. (17) of [sharf1993]:
//     D f+ = omega (b + L f+ + U f) + (1 - omega) D f.

#include <memory>

#include "linkwise/solve/iterative/relaxation.hpp"

namespace linkwise {

class SuccessiveOverRelaxation final : public Relaxation {
 public:
  SuccessiveOverRelaxation(const SolverOptions& options, SweepOrder order)
      : Relaxation(options, order) {}

  /// The factor of the last sweep.
  double omega() const { return omega_; }

 private:
  Outcome prepare(const BlockTree& A) override;
  void start() override;
  double relaxation_factor(double change, double previous_change) override;
  double adapt(double change, double previous_change);

  SpectrumEstimator estimator_;
  double omega_ = 1.0;
  double previous_ratio_ = 0.0;
  int sweeps_ = 0;  ///< since omega last changed
};

std::unique_ptr<LinearSolver> make_sor(const SolverOptions& options);

}  // namespace linkwise
