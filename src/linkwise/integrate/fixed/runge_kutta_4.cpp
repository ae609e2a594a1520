/// The classical Runge-Kutta method of order 4 [kutta1901]:
///   k1 = f(t, y), k2 = f(t + h/2, y + h/2 k1), k3 = f(t + h/2, y + h/2 k2), k4 = f(t + h, y + h
///   k3), y(t + h) = y + h/6 (k1 + 2 k2 + 2 k3 + k4).
/// Between steps it is the cubic Hermite polynomial through both ends and their derivatives, whose
/// error O(h^4) is of the order of the method. The derivative at the end is the next step's k1, so
/// dense output costs no evaluation.
#include <cstddef>
#include <vector>

#include "linkwise/integrate/fixed/fixed_step.hpp"

namespace linkwise {
namespace {

class RungeKutta4 final : public FixedStep {
 public:
  using FixedStep::FixedStep;

 private:
  int order() const override { return 4; }

  void prepare() override {
    const std::size_t n = system_.size();
    for (std::vector<double>* k : {&start_rate_, &end_rate_, &k2_, &k3_, &k4_, &stage_}) {
      k->assign(n, 0.0);
    }
    end_rate_known_ = false;
  }

  void renew() override { end_rate_known_ = false; }

  Outcome advance(double t, double h) override {
    if (!end_rate_known_) {
      const Outcome outcome = system_.evaluate(t, y().data(), end_rate_.data());
      if (outcome != Outcome::converged) return outcome;
      end_rate_known_ = true;
    }
    const std::vector<double>& k1 = end_rate_;
    for (const auto& [fraction, from, to] :
         {Stage{0.5, &k1, &k2_}, Stage{0.5, &k2_, &k3_}, Stage{1.0, &k3_, &k4_}}) {
      for (std::size_t i = 0; i < stage_.size(); ++i) {
        stage_[i] = y()[i] + fraction * h * (*from)[i];
      }
      const Outcome outcome = system_.evaluate(t + fraction * h, stage_.data(), to->data());
      if (outcome != Outcome::converged) return outcome;
    }
    for (std::size_t i = 0; i < stage_.size(); ++i) {
      next()[i] = y()[i] + h / 6.0 * (k1[i] + 2.0 * (k2_[i] + k3_[i]) + k4_[i]);
    }
    if (!all_finite(next())) return Outcome::not_finite;
    Outcome outcome = system_->project(t + h, next().data());
    if (outcome != Outcome::converged) return outcome;
    outcome = system_.evaluate(t + h, next().data(), stage_.data());
    if (outcome != Outcome::converged) return outcome;
    start_rate_.swap(end_rate_);
    end_rate_.swap(stage_);
    return Outcome::converged;
  }

  void interpolate_fraction(double s, std::span<double> result) override {
    const double r = 1.0 - s;
    const double w0 = r * r * (1.0 + 2.0 * s), w1 = s * s * (3.0 - 2.0 * s);
    const double d0 = s * r * r * h(), d1 = -s * s * r * h();
    for (std::size_t i = 0; i < result.size(); ++i) {
      result[i] = w0 * previous()[i] + w1 * y()[i] + d0 * start_rate_[i] + d1 * end_rate_[i];
    }
  }

  struct Stage {
    double fraction;
    const std::vector<double>* from;
    std::vector<double>* to;
  };

  std::vector<double> start_rate_, end_rate_, k2_, k3_, k4_, stage_;
  bool end_rate_known_ = false;
};

}  // namespace

std::unique_ptr<Integrator> make_runge_kutta_4(OdeSystem& system,
                                               const IntegratorOptions& options) {
  return std::make_unique<RungeKutta4>(system, options);
}

}  // namespace linkwise
