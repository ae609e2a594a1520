/// The L-stable ESDIRK547L2SA2 of order 5 [kennedy2019] from SUNDIALS' ARKODE: seven stages, six of
/// them implicit with one coefficient. Newton's matrix I - gamma J is that of the stiff part alone
/// where a system solves it, as trees do by their recursion: the cost stays linear in the number of
/// bodies, and no evaluation is spent on derivatives. Other systems have theirs by differences.
///
/// Errors are tested as CVODE's are. States are projected after the test. Samples come off
/// polynomials through the ends of steps (step_history.hpp), so steps do not depend on them.
#if defined(LINKWISE_SUNDIALS_ARKODE)
#include <algorithm>
#include <arkode/arkode_arkstep.h>
#include <cmath>
#include <exception>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include "linkwise/base/assert.hpp"
#include "linkwise/integrate/checked_system.hpp"
#include "linkwise/integrate/error_scale.hpp"
#include "linkwise/integrate/step_history.hpp"
#include "linkwise/integrate/sundials/handles.hpp"
#include "linkwise/integrate/sundials/newton_cost.hpp"
#include "linkwise/integrate/sundials/stiff_solver.hpp"

namespace linkwise {
namespace {

using namespace sundials;

constexpr int krylov_dimension = 30;
constexpr int order = 5;
/// Of Newton, at most: without the parts of J that are not stiff, each gains a digit or two.
constexpr int most_iterations = 8;
/// In a row, each with a step that is shorter by a factor of 2 to 10: down to any stop.
constexpr int most_failures = 40;
/// Of rates within a step, in units of the tolerance.
constexpr double most_contradiction = 1000.0;
/// Stages are predicted by the polynomial through the last steps.
constexpr int maximum_order = 1;
/// Where these fail, as in front of stops, GMRES takes over for so many steps.
constexpr long krylov_steps = 5;

/// A stop time that is not reached.
constexpr double never = 1e300;

void free_arkode(void* memory) { ARKodeFree(&memory); }
using ArkodeMemory = std::unique_ptr<void, Destroy<free_arkode>>;

class Esdirk final : public Integrator {
 public:
  Esdirk(OdeSystem& system, const IntegratorOptions& options);

  void start(double t0, std::span<const double> y0) override;
  Outcome step(double t_limit) override;
  void interpolate(double t, std::span<double> y) override;
  double time() const override { return time_; }
  IntegratorStatistics statistics() const override;

 private:
  void attach_solvers();
  void choose_solver();
  void restart();
  void begin_anew(double first_step);
  int start_with(double limit, double horizon, double& t);
  bool hides_a_kink(double t);
  bool moved_to(double t) const;  ///< whether the step there is more than round-off
  void read_counters();
  Outcome classify(int flag) const;
  Outcome no_smaller_step() const;
  template <class F>
  static int answer(void* self, F&& f);
  static int right_hand_side(sunrealtype t, N_Vector y, N_Vector ydot, void* self);
  static int error_weights(N_Vector y, N_Vector weight, void* self);
  static int project(sunrealtype t, N_Vector y, void* self);
  static int prepare(sunrealtype t, N_Vector y, N_Vector rate, sunbooleantype matrix_is_good,
                     sunbooleantype* matrix_is_new, sunrealtype gamma, void* self);
  static int precondition(sunrealtype t, N_Vector y, N_Vector rate, N_Vector r, N_Vector z,
                          sunrealtype gamma, sunrealtype delta, int side, void* self);

  double* data(const Vector& vector) const { return N_VGetArrayPointer(vector.get()); }
  std::size_t size() const { return system_.size(); }

  CheckedSystem system_;
  IntegratorOptions options_;
  Context context_;
  Vector y_;  ///< what ARKODE returned last
  Matrix matrix_;
  LinearSolverHandle linear_solver_;
  std::optional<StiffSolver> stiff_solver_;  ///< in its place
  long failures_seen_ = 0, iterates_until_ = 0;
  NonlinearSolverHandle nonlinear_solver_;
  ArkodeMemory memory_;

  std::vector<double> state_;  ///< at time_
  StepHistory history_;
  double time_ = 0.0;
  bool restart_needed_ = false;
  bool jumped_ = false;                   ///< in the last step
  Outcome failure_ = Outcome::converged;  ///< of the last evaluation that failed
  long steps_since_failure_ = 0;
  std::exception_ptr exception_;
  IntegratorStatistics counters_;  ///< since the last restart, as ARKODE counts
  IntegratorStatistics earlier_;   ///< before it; their cost is that of linear algebra
};

Esdirk::Esdirk(OdeSystem& system, const IntegratorOptions& options)
    : system_(system), options_(options) {
  // The norm is a mean over the components: a system without any gets one that stays zero.
  const auto length = static_cast<sunindextype>(std::max<std::size_t>(size(), 1));
  y_.reset(check_allocated(N_VNew_Serial(length, context_)));
  N_VConst(0.0, y_.get());
  memory_.reset(check_allocated(ARKStepCreate(nullptr, right_hand_side, 0.0, y_.get(), context_)));
  void* memory = memory_.get();
  check(ARKodeSetUserData(memory, this), "ARKodeSetUserData");
  check(ARKodeWFtolerances(memory, error_weights), "ARKodeWFtolerances");
  check(ARKStepSetTableNum(memory, ARKODE_ESDIRK547L2SA2_7_4_5, ARKODE_ERK_NONE),
        "ARKStepSetTableNum");
  check(ARKodeSetInterpolantType(memory, ARK_INTERP_LAGRANGE), "ARKodeSetInterpolantType");
  check(ARKodeSetMaxHnilWarns(memory, -1), "ARKodeSetMaxHnilWarns");
  if (options.max_step > 0.0) check(ARKodeSetMaxStep(memory, options.max_step), "ARKodeSetMaxStep");
  if (system.constrained())
    check(ARKodeSetPostprocessStepFn(memory, project), "ARKodeSetPostprocessStepFn");
  // A matrix of another gamma leaves errors in stiff components, which the error test sees in turn.
  check(ARKodeSetLSetupFrequency(memory, 1), "ARKodeSetLSetupFrequency");
  check(ARKodeSetMaxConvFails(memory, most_failures), "ARKodeSetMaxConvFails");
  check(ARKodeSetMaxErrTestFails(memory, most_failures), "ARKodeSetMaxErrTestFails");
  attach_solvers();
}

void Esdirk::attach_solvers() {
  void* memory = memory_.get();
  nonlinear_solver_.reset(check_allocated(SUNNonlinSol_Newton(y_.get(), context_)));
  check(ARKodeSetNonlinearSolver(memory, nonlinear_solver_.get()), "ARKodeSetNonlinearSolver");
  const sunindextype n = N_VGetLength(y_.get());
  check(ARKodeSetPredictorMethod(memory, maximum_order), "ARKodeSetPredictorMethod");
  check(ARKodeSetDeduceImplicitRhs(memory, SUNTRUE), "ARKodeSetDeduceImplicitRhs");
  if (system_->solves_stiff_part()) {
    stiff_solver_.emplace(y_.get(), krylov_dimension, context_);
    check(ARKodeSetLinearSolver(memory, stiff_solver_->get(), nullptr), "ARKodeSetLinearSolver");
    check(ARKodeSetPreconditioner(memory, prepare, precondition), "ARKodeSetPreconditioner");
    check(ARKodeSetMaxNonlinIters(memory, most_iterations), "ARKodeSetMaxNonlinIters");
    return;
  }
  if (n <= largest_dense_size) {
    matrix_.reset(check_allocated(SUNDenseMatrix(n, n, context_)));
    linear_solver_.reset(check_allocated(SUNLinSol_Dense(y_.get(), matrix_.get(), context_)));
  } else {
    linear_solver_.reset(
        check_allocated(SUNLinSol_SPGMR(y_.get(), SUN_PREC_NONE, krylov_dimension, context_)));
  }
  check(ARKodeSetLinearSolver(memory, linear_solver_.get(), matrix_.get()),
        "ARKodeSetLinearSolver");
}

/// Where Newton's iteration has failed, GMRES makes it good for the next steps.
void Esdirk::choose_solver() {
  long steps = 0, failures = 0;
  ARKodeGetNumSteps(memory_.get(), &steps);
  ARKodeGetNumNonlinSolvConvFails(memory_.get(), &failures);
  if (failures > failures_seen_) iterates_until_ = steps + krylov_steps;
  failures_seen_ = failures;
  stiff_solver_->iterates = steps < iterates_until_;
}

/// What ARKODE's callbacks share: f(esdirk) gives an outcome.
template <class F>
int Esdirk::answer(void* self, F&& f) {
  Esdirk& esdirk = *static_cast<Esdirk*>(self);
  // Exceptions must not unwind through C.
  try {
    const Outcome outcome = f(esdirk);
    if (outcome == Outcome::converged) return 0;
    esdirk.failure_ = outcome;
    esdirk.steps_since_failure_ = 0;
    return 1;  // positive: ARKODE tries again with a smaller step
  } catch (...) {
    esdirk.exception_ = std::current_exception();
    return -1;
  }
}

int Esdirk::right_hand_side(sunrealtype t, N_Vector y, N_Vector ydot, void* self) {
  return answer(self, [&](Esdirk& esdirk) {
    double* rate = N_VGetArrayPointer(ydot);
    if (esdirk.size() == 0) *rate = 0.0;
    return esdirk.system_.evaluate(t, N_VGetArrayPointer(y), rate);
  });
}

int Esdirk::error_weights(N_Vector y, N_Vector weight, void* self) {
  const Esdirk& esdirk = *static_cast<Esdirk*>(self);
  N_VConst(1.0, weight);
  tolerated_errors(*esdirk.system_, esdirk.options_, {N_VGetArrayPointer(y), esdirk.size()},
                   N_VGetArrayPointer(weight));
  N_VInv(weight, weight);
  return 0;
}

int Esdirk::project(sunrealtype t, N_Vector y, void* self) {
  return answer(self,
                [&](Esdirk& esdirk) { return esdirk.system_->project(t, N_VGetArrayPointer(y)); });
}

int Esdirk::prepare(sunrealtype t, N_Vector y, N_Vector /*rate*/, sunbooleantype /*matrix_is_good*/,
                    sunbooleantype* matrix_is_new, sunrealtype gamma, void* self) {
  *matrix_is_new = SUNTRUE;
  static_cast<Esdirk*>(self)->choose_solver();
  return answer(self, [&](Esdirk& esdirk) {
    return esdirk.system_->factor_stiff_part(t, N_VGetArrayPointer(y), gamma);
  });
}

int Esdirk::precondition(sunrealtype /*t*/, N_Vector /*y*/, N_Vector /*rate*/, N_Vector r,
                         N_Vector z, sunrealtype /*gamma*/, sunrealtype /*delta*/, int /*side*/,
                         void* self) {
  return answer(self, [&](Esdirk& esdirk) {
    if (esdirk.size() == 0) return N_VScale(1.0, r, z), Outcome::converged;
    esdirk.system_->solve_stiff_part(N_VGetArrayPointer(r), N_VGetArrayPointer(z));
    return Outcome::converged;
  });
}

void Esdirk::start(double t0, std::span<const double> y0) {
  LINKWISE_ASSERT(y0.size() == size(), "y0 has the length of the system");
  state_.assign(y0.begin(), y0.end());
  system_->project(t0, state_.data());
  time_ = t0;
  system_.evaluations = 0;
  counters_ = earlier_ = {};
  failure_ = Outcome::converged;
  restart();
}

/// Begins anew at time_ and state_.
void Esdirk::restart() {
  begin_anew(0.0);
  history_.restart(time_, state_);
}

/// The same, with all that is known of the steps before; first_step: 0, to be chosen.
void Esdirk::begin_anew(double first_step) {
  N_VConst(0.0, y_.get());
  std::copy(state_.begin(), state_.end(), data(y_));
  check(ARKStepReInit(memory_.get(), nullptr, right_hand_side, time_, y_.get()), "ARKStepReInit");
  earlier_.steps += counters_.steps;
  earlier_.error_test_failures += counters_.error_test_failures;
  earlier_.nonlinear_failures += counters_.nonlinear_failures;
  earlier_.cost += counters_.cost;
  counters_ = {};
  check(ARKodeSetInitStep(memory_.get(), first_step), "ARKodeSetInitStep");
  restart_needed_ = jumped_ = false;
  iterates_until_ = 0;
  ARKodeGetNumNonlinSolvConvFails(memory_.get(), &failures_seen_);
}

Outcome Esdirk::step(double t_limit) {
  if (options_.max_steps > 0 && earlier_.steps + counters_.steps >= options_.max_steps) {
    return Outcome::too_many_steps;
  }
  if (restart_needed_) restart();
  const double limit = system_.begin_step(time_);
  check(ARKodeSetStopTime(memory_.get(), std::min(limit, never)), "ARKodeSetStopTime");
  // ARKODE bounds its very first step by a tenth of the distance to this time and ignores it later.
  const double reach = options_.max_step > 0.0 ? 10.0 * options_.max_step : 1.0;
  const double horizon = std::min(time_ + reach, limit);
  sunrealtype t = time_;
  int flag = ARKodeEvolve(memory_.get(), horizon, y_.get(), &t, ARK_ONE_STEP);
  if (flag >= 0 && counters_.steps == 0 && !moved_to(t)) flag = start_with(limit, horizon, t);
  if (exception_) std::rethrow_exception(std::exchange(exception_, nullptr));
  if (flag < 0) return classify(flag);
  if (!all_finite({data(y_), size()})) return Outcome::not_finite;
  // Steps that round-off swallows would never end.
  if (!moved_to(t)) return no_smaller_step();
  if (jumped_) history_.restart(time_, state_);
  history_.add(t, {data(y_), size()});
  const auto state_at = [this](double at, double* y) {
    history_.interpolate(at, system_, {y, size()});
  };
  if (system_->retakes(time_, t, data(y_), state_at)) {
    restart();
    return step(t_limit);
  }
  if (hides_a_kink(t)) return step(t_limit);
  std::copy_n(data(y_), size(), state_.begin());
  time_ = t;
  ++steps_since_failure_;
  restart_needed_ = t == limit && system_->breaks_at(t);
  read_counters();
  system_->accepted(time_, state_.data());
  jumped_ = system_->has_jumped();
  return Outcome::converged;
}

/// A step over friction that turns, or a stop, may end right and say nothing true of what is
/// within. Then it is to be taken again, shorter.
bool Esdirk::hides_a_kink(double t) {
  const double tolerance =
      options_.relative_tolerance > 0.0 ? options_.relative_tolerance : options_.tolerance;
  // Late in time the length of a short step is known to few digits.
  const double blur = std::numeric_limits<double>::epsilon() * std::abs(t) / (t - time_);
  if (!(history_.contradiction(system_) > most_contradiction * std::max(tolerance, blur)))
    return false;
  const double shorter = 0.25 * (t - time_);
  if (!moved_to(time_ + shorter)) return false;
  history_.drop_last();
  begin_anew(shorter);
  return true;
}

/// The very first step may be shorter than times differ by, as CVODE's (Cvode::start_with).
int Esdirk::start_with(double limit, double horizon, double& t) {
  const double smallest = 4096 * std::numeric_limits<double>::epsilon() * std::abs(time_);
  begin_anew(std::min(smallest, 0.1 * (horizon - time_)));
  check(ARKodeSetStopTime(memory_.get(), std::min(limit, never)), "ARKodeSetStopTime");
  t = time_;
  return ARKodeEvolve(memory_.get(), horizon, y_.get(), &t, ARK_ONE_STEP);
}

bool Esdirk::moved_to(double t) const {
  return t > time_ + 4.0 * std::numeric_limits<double>::epsilon() * std::abs(time_);
}

Outcome Esdirk::classify(int flag) const {
  switch (flag) {
    case ARK_RHSFUNC_FAIL:
    case ARK_FIRST_RHSFUNC_ERR:
    case ARK_REPTD_RHSFUNC_ERR:
    case ARK_UNREC_RHSFUNC_ERR:
    case ARK_TOO_MUCH_ACC:
    case ARK_ERR_FAILURE:
    case ARK_CONV_FAILURE:
    case ARK_LSETUP_FAIL:
    case ARK_LSOLVE_FAIL:
    case ARK_NLS_SETUP_FAIL:
    case ARK_NLS_SETUP_RECVR:
    case ARK_POSTPROCESS_STEP_FAIL:
    case ARK_ILL_INPUT:  // of a step: times too close together to choose one
    case ARK_TOO_CLOSE:
      return no_smaller_step();
    default:
      check(flag, "ARKodeEvolve");
      return Outcome::step_too_small;
  }
}

/// Why the steps became too small: in front of a time or state that cannot be evaluated they creep
/// up to it.
Outcome Esdirk::no_smaller_step() const {
  constexpr long recent = 20;
  const bool failed = failure_ != Outcome::converged && steps_since_failure_ <= recent;
  return failed ? failure_ : Outcome::step_too_small;
}

void Esdirk::read_counters() {
  void* memory = memory_.get();
  ARKodeGetNumSteps(memory, &counters_.steps);
  ARKodeGetNumErrTestFails(memory, &counters_.error_test_failures);
  ARKodeGetNumNonlinSolvConvFails(memory, &counters_.nonlinear_failures);
  ARKodeGetLastStep(memory, &counters_.last_step);
  counters_.last_order = order;
  const int n = static_cast<int>(size());
  long factors = 0, solutions = 0;
  if (matrix_) {
    ARKodeGetNumLinSolvSetups(memory, &factors);
    ARKodeGetNumNonlinSolvIters(memory, &solutions);
    counters_.cost = static_cast<double>(factors) * factor_cost(n) +
                     static_cast<double>(solutions) * solution_cost(n);
  } else {
    ARKodeGetNumPrecEvals(memory, &factors);
    ARKodeGetNumPrecSolves(memory, &solutions);
    counters_.cost = stiff_factor_cost * static_cast<double>(factors) +
                     stiff_solution_cost * static_cast<double>(solutions);
  }
}

void Esdirk::interpolate(double t, std::span<double> y) {
  LINKWISE_ASSERT(y.size() == size(), "y has the length of the system");
  if (t == time_ || !history_.has_step()) {
    LINKWISE_ASSERT(t == time_, "there is no step to interpolate in");
    std::copy(state_.begin(), state_.end(), y.begin());
    return;
  }
  history_.interpolate(t, system_, y);
  system_->project(t, y.data());
}

IntegratorStatistics Esdirk::statistics() const {
  IntegratorStatistics result = counters_;
  result.steps += earlier_.steps;
  result.evaluations = system_.evaluations;
  result.error_test_failures += earlier_.error_test_failures;
  result.nonlinear_failures += earlier_.nonlinear_failures;
  result.cost += earlier_.cost + static_cast<double>(system_.evaluations);
  return result;
}

}  // namespace

std::unique_ptr<Integrator> make_esdirk(OdeSystem& system, const IntegratorOptions& options) {
  return std::make_unique<Esdirk>(system, options);
}

}  // namespace linkwise
#endif
