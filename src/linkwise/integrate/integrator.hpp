#pragma once

#include <memory>
#include <span>
#include <string_view>

namespace linkwise {

/// The equations of motion as the integrators see them: ydot = f(t, y) with y = [q; v].
struct OdeSystem {
  virtual ~OdeSystem() = default;

  virtual int size() const = 0;           ///< length of y
  virtual int position_size() const = 0;  ///< length of q; v is the rest

  /// Writes f(t, y); false when it cannot be evaluated (not finite, or a solver failed).
  virtual bool evaluate(double t, const double* y, double* ydot) = 0;

  /// Writes qdot for the velocities v, which is not v where a joint has a quaternion.
  virtual void position_rates(const double* q, const double* v, double* qdot) = 0;

  /// Projects y onto its constraints: quaternions back to unit length.
  virtual void normalise(double* y) = 0;

  /// Called after each accepted step.
  virtual void accepted(double /*t*/, const double* /*y*/) {}
};

enum class IntegratorKind { adams, bdf, runge_kutta_4, semi_implicit_euler };

struct IntegratorOptions {
  double tolerance = 1e-6;          ///< relative and absolute, unless given apart below
  double relative_tolerance = 0.0;  ///< 0: as tolerance
  double absolute_tolerance = 0.0;  ///< 0: as tolerance
  double step = 0.0;                ///< the step of the fixed-step kinds, which need it
  double max_step = 0.0;            ///< 0: no bound; variable-step kinds only
  int max_order = 0;                ///< 0: the highest, 12 for adams and 5 for bdf
  long max_steps = 0;               ///< steps per start(); 0: no bound
};

enum class StepStatus {
  ok,
  evaluation_failed,  ///< f could not be evaluated, even with much smaller steps
  not_finite,         ///< f or y holds NaN or infinity
  step_too_small,     ///< the error test or the corrector fails at the smallest possible step
  too_many_steps,
};

std::string_view describe(StepStatus status);

struct IntegratorStatistics {
  long steps = 0;
  long evaluations = 0;
  long error_test_failures = 0;
  long nonlinear_failures = 0;
  double last_step = 0.0;
  int last_order = 0;
};

/// Advances one OdeSystem from one start. The system must outlive it.
class Integrator {
 public:
  virtual ~Integrator() = default;

  virtual void start(double t0, std::span<const double> y0) = 0;

  /// Takes one accepted step towards t_limit, past it where the method's own step leads there: the
  /// steps do not depend on where output is asked for. A status other than ok leaves time() and the
  /// last step's interpolant as they were.
  virtual StepStatus step(double t_limit) = 0;

  /// Writes y(t) for t within the last step.
  virtual void interpolate(double t, std::span<double> y) = 0;

  virtual double time() const = 0;
  virtual IntegratorStatistics statistics() const = 0;
};

struct IntegratorEntry {
  IntegratorKind kind;
  std::string_view name;
  std::string_view description;
  bool fixed_step;
};

/// Every integrator of this build, in the order in which they are listed to users.
std::span<const IntegratorEntry> integrator_registry();

/// The entry called name; InputError that lists the known ones otherwise.
const IntegratorEntry& find_integrator(std::string_view name);

/// InputError when an option is out of range for the kind or the build lacks the kind.
std::unique_ptr<Integrator> make_integrator(IntegratorKind kind, OdeSystem& system,
                                            const IntegratorOptions& options);

}  // namespace linkwise
