#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "linkwise/base/outcome.hpp"

namespace linkwise {

/// The equations of motion as the integrators see them: ydot = f(t, y) with y = [q; v].
///
/// Where y must satisfy constraints, integrators project it after every accepted step. The y given
/// to evaluate() may be off them by the error of a step: rotations must come from the normalised
/// quaternion, and the rates stay linear in the one given.
struct OdeSystem {
  virtual ~OdeSystem() = default;

  virtual int size() const = 0;           ///< length of y
  virtual int position_size() const = 0;  ///< length of q; v is the rest

  /// Writes f(t, y). An outcome other than `converged` says why it cannot be evaluated; integrators
  /// may then try a smaller step, and end with that outcome where none helps.
  virtual Outcome evaluate(double t, const double* y, double* ydot) = 0;

  /// The same, and leaves no trace in what evaluate() gives: for looks at states that are not on
  /// the way. Systems that remember earlier evaluations override it.
  virtual Outcome evaluate_aside(double t, const double* y, double* ydot) {
    return evaluate(t, y, ydot);
  }

  /// Writes qdot for the velocities v, which is not v where a joint has a quaternion.
  virtual void position_rates(const double* q, const double* v, double* qdot) = 0;

  /// Whether project() may change anything; the same for the system's whole life.
  virtual bool constrained() const { return false; }
  /// Moves y, which is off its constraints by no more than the error of a step, onto them: first
  /// the positions, then the velocities. After an outcome other than `converged`, y is what it was.
  virtual Outcome project(double /*t*/, double* /*y*/) { return Outcome::converged; }

  /// Writes what the relative tolerance is taken of, per component: not negative.
  virtual void error_scale(const double* y, double* scale) const {
    for (int i = 0; i < size(); ++i) scale[i] = std::abs(y[i]);
  }

  /// Whether it solves its own stiff part, z = (I - gamma J)^-1 r with J the derivatives of f by y
  /// that springs and dampers make. What J leaves out is left to iterations.
  virtual bool solves_stiff_part() const { return false; }
  /// Makes ready for solve_stiff_part() at (t, y).
  virtual Outcome factor_stiff_part(double /*t*/, const double* /*y*/, double /*gamma*/) {
    return Outcome::converged;
  }
  /// r, z [size()]; not in place.
  virtual void solve_stiff_part(const double* /*r*/, double* /*z*/) {}

  /// Lowers the errors that a step may make, allowed [size()], where more than the state suffers.
  virtual void limit_errors(const double* /*y*/, double* /*allowed*/) const {}

  /// The latest time at which a step that begins at t may end: what acts from outside takes another
  /// course there, which evaluations before and after it would not show. Infinite: none is known.
  virtual double step_limit(double /*t*/) { return std::numeric_limits<double>::infinity(); }
  /// Whether f(t, y) or a low derivative of it jumps at time t, so that methods begin anew there.
  virtual bool breaks_at(double /*t*/) { return false; }

  /// Whether the step from `begin` to `end`, where it is y, has to be taken again, because it has
  /// passed what it should have met. step_limit(begin) then says where it ends. state(t, y) writes
  /// what the step says of a time within it.
  virtual bool retakes(double /*begin*/, double /*end*/, const double* /*y*/,
                       const std::function<void(double, double*)>& /*state*/) {
    return false;
  }

  /// Whether derivatives of f have jumped in the step accepted last, so that none before it hold.
  virtual bool has_jumped() const { return false; }

  /// Called after each accepted step, with y projected.
  virtual void accepted(double /*t*/, const double* /*y*/) {}
};

struct IntegratorOptions {
  double tolerance = 1e-6;          ///< relative and absolute, unless given apart below
  double relative_tolerance = 0.0;  ///< 0: as tolerance
  double absolute_tolerance = 0.0;  ///< 0: as tolerance
  double step = 0.0;                ///< of the fixed-step kinds, which need it
  double max_step = 0.0;            ///< of the variable-step kinds; 0: no bound
  int max_order = 0;   ///< of the multistep kinds; 0: 12 for adams, 5 for bdf; auto takes both
  long max_steps = 0;  ///< for one start(); 0: no bound
};

struct IntegratorStatistics {
  long steps = 0;
  long evaluations = 0;  ///< with those that looked for stiffness
  long error_test_failures = 0;
  long nonlinear_failures = 0;
  double last_step = 0.0;
  int last_order = 0;
  double cost = 0.0;  ///< of multistep kinds: evaluations, and linear algebra in units of one
};

/// Advances one OdeSystem, which must outlive it. Exceptions of the system pass through.
class Integrator {
 public:
  Integrator() = default;
  Integrator(const Integrator&) = delete;
  Integrator& operator=(const Integrator&) = delete;
  virtual ~Integrator() = default;

  virtual void start(double t0, std::span<const double> y0) = 0;

  /// Takes one accepted step from time(), past t_limit where the method's own step leads there: the
  /// steps do not depend on where output is asked for. They end at the system's step_limit() at the
  /// latest, and where it breaks, f is evaluated on one side of the break in each step. After an
  /// outcome other than `converged`, time() and the state there are those of the last accepted step
  /// and only start() may follow.
  virtual Outcome step(double t_limit) = 0;

  /// Writes y(t), projected, for t within the last step (or at the start, before the first one).
  virtual void interpolate(double t, std::span<double> y) = 0;

  virtual double time() const = 0;
  virtual IntegratorStatistics statistics() const = 0;
  /// Since when the motion is stiff and what follows, one line; empty where nothing was noticed.
  virtual std::string stiffness() const { return {}; }
};

struct IntegratorEntry {
  std::string_view name;
  std::string_view description;
  int highest_order;
  bool fixed_step = false;
  std::unique_ptr<Integrator> (*make)(OdeSystem&, const IntegratorOptions&);
};

/// Every integrator of this build, in the order in which users see them listed.
std::span<const IntegratorEntry> integrator_registry();

/// The entry of that name; InputError that lists the known ones otherwise.
const IntegratorEntry& find_integrator(std::string_view name);

/// The names of those with a fixed step, as a user reads them: a or b.
std::string fixed_step_names();

/// InputError where an option is out of range, or the build has no integrator of that name.
void check_integrator(std::string_view name, const IntegratorOptions& options);
std::unique_ptr<Integrator> make_integrator(std::string_view name, OdeSystem& system,
                                            const IntegratorOptions& options);

}  // namespace linkwise
