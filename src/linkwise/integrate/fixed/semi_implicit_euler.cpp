/// Semi-implicit Euler [hairer2006, I.1.2]:
///   v(t + h) = v + h vdot(t, q, v),   q(t + h) = q + h qdot(q, v(t + h)).
/// Order 1, one evaluation per step. It is symplectic, with a bounded error of the energy, only
/// where forces are conservative and the inertia is constant; with rates v in place of momenta it
/// is not as soon as the inertia depends on the position. Between steps it is linear, which is what
/// the method assumes of q.
#include <cstddef>
#include <vector>

#include "linkwise/integrate/fixed/fixed_step.hpp"

namespace linkwise {
namespace {

class SemiImplicitEuler final : public FixedStep {
 public:
  using FixedStep::FixedStep;

 private:
  int order() const override { return 1; }

  void prepare() override { rate_.assign(system_.size(), 0.0); }

  Outcome advance(double t, double h) override {
    const Outcome outcome = system_.evaluate(t, y().data(), rate_.data());
    if (outcome != Outcome::converged) return outcome;
    const std::size_t nq = system_.position_size();
    for (std::size_t i = nq; i < rate_.size(); ++i) next()[i] = y()[i] + h * rate_[i];
    system_->position_rates(y().data(), next().data() + nq, rate_.data());
    for (std::size_t i = 0; i < nq; ++i) next()[i] = y()[i] + h * rate_[i];
    if (!all_finite(next())) return Outcome::not_finite;
    return system_->project(t + h, next().data());
  }

  void interpolate_fraction(double s, std::span<double> result) override {
    for (std::size_t i = 0; i < result.size(); ++i) {
      result[i] = (1.0 - s) * previous()[i] + s * y()[i];
    }
  }

  std::vector<double> rate_;
};

}  // namespace

std::unique_ptr<Integrator> make_semi_implicit_euler(OdeSystem& system,
                                                     const IntegratorOptions& options) {
  return std::make_unique<SemiImplicitEuler>(system, options);
}

}  // namespace linkwise
