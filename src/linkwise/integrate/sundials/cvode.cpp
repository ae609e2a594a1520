/// CVODE's variable-order, variable-step multistep methods [hindmarsh2005]: Adams-Moulton with
/// functional iteration, and backward differentiation with Newton iteration. The error test bounds
/// the root mean square of e_i / (rtol scale_i + atol) by 1 in every step. Output is read off the
/// method's own interpolating polynomial, so the steps do not depend on the output times.
#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <utility>
#include <vector>

#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <sunnonlinsol/sunnonlinsol_newton.h>

#include "linkwise/base/assert.hpp"
#include "linkwise/integrate/checked_system.hpp"
#include "linkwise/integrate/error_scale.hpp"
#include "linkwise/integrate/sundials/handles.hpp"
#include "linkwise/integrate/sundials/newton_cost.hpp"

namespace linkwise {
namespace {

using namespace sundials;

constexpr int krylov_dimension = 30;

/// A stop time that is not reached.
constexpr double never = 1e300;

class Cvode final : public Integrator {
 public:
  Cvode(int method, OdeSystem& system, const IntegratorOptions& options);

  void start(double t0, std::span<const double> y0) override;
  Outcome step(double t_limit) override;
  void interpolate(double t, std::span<double> y) override;
  double time() const override { return time_; }
  IntegratorStatistics statistics() const override;

 private:
  void attach_solvers(int method);
  void restart();
  int start_with(double limit, double horizon, double& t);
  bool moved_to(double t) const;  ///< whether the step there is more than round-off
  Outcome take_state(double t);
  void read_counters();
  Outcome classify(int flag) const;
  Outcome no_smaller_step() const;
  static int right_hand_side(sunrealtype t, N_Vector y, N_Vector ydot, void* self);
  static int error_weights(N_Vector y, N_Vector weight, void* self);
  template <class F>
  static int answer(void* self, F&& f);
  static int projection(sunrealtype t, N_Vector y, N_Vector correction, sunrealtype tolerance,
                        N_Vector error, void* self);
  Outcome project(double t, const double* y);

  double* data(const Vector& vector) const { return N_VGetArrayPointer(vector.get()); }
  std::size_t size() const { return system_.size(); }

  CheckedSystem system_;
  int method_;
  IntegratorOptions options_;
  Context context_;
  Vector y_;        ///< what CVODE returned last
  Vector scratch_;  ///< interpolated values
  Matrix matrix_;
  LinearSolverHandle linear_solver_;
  NonlinearSolverHandle nonlinear_solver_;
  Memory memory_;

  std::vector<double> state_;  ///< projected, at time_
  bool write_back_ = false;    ///< state_ into CVODE's history, before its next step
  std::vector<double> projected_;
  double time_ = 0.0;
  bool interpolant_valid_ = false;
  bool restart_needed_ = false;
  Outcome failure_ = Outcome::converged;  ///< of the last evaluation that failed
  long steps_since_failure_ = 0;
  std::exception_ptr exception_;
  IntegratorStatistics counters_;  ///< since the last restart, as CVODE counts
  IntegratorStatistics earlier_;   ///< before it; their cost is that of linear algebra
};

Cvode::Cvode(int method, OdeSystem& system, const IntegratorOptions& options)
    : system_(system), method_(method), options_(options) {
  // CVODE's norm is a mean over the components: a system without any gets one that stays zero.
  const auto length = static_cast<sunindextype>(std::max<std::size_t>(size(), 1));
  y_.reset(check_allocated(N_VNew_Serial(length, context_)));
  scratch_.reset(check_allocated(N_VNew_Serial(length, context_)));
  N_VConst(0.0, y_.get());
  memory_.reset(check_allocated(CVodeCreate(method, context_)));
  void* memory = memory_.get();
  check(CVodeInit(memory, right_hand_side, 0.0, y_.get()), "CVodeInit");
  check(CVodeSetUserData(memory, this), "CVodeSetUserData");
  check(CVodeWFtolerances(memory, error_weights), "CVodeWFtolerances");
  check(CVodeSetMaxHnilWarns(memory, -1), "CVodeSetMaxHnilWarns");
#if SUNDIALS_VERSION_MAJOR < 7
  check(CVodeSetErrFile(memory, nullptr), "CVodeSetErrFile");
#endif
  if (options.max_order > 0) check(CVodeSetMaxOrd(memory, options.max_order), "CVodeSetMaxOrd");
  if (options.max_step > 0.0) check(CVodeSetMaxStep(memory, options.max_step), "CVodeSetMaxStep");
  attach_solvers(method);
  if (method == CV_BDF && system.constrained()) {
    check(CVodeSetProjFn(memory, projection), "CVodeSetProjFn");
    // The error test sees the whole error. Its part along the constraints vanishes to leading order
    // where a motion turns at constant rate, and orders would be chosen by what is left.
    check(CVodeSetProjErrEst(memory, SUNFALSE), "CVodeSetProjErrEst");
  }
}

void Cvode::attach_solvers(int method) {
  void* memory = memory_.get();
  if (method == CV_ADAMS) {
    nonlinear_solver_.reset(check_allocated(SUNNonlinSol_FixedPoint(y_.get(), 0, context_)));
  } else {
    nonlinear_solver_.reset(check_allocated(SUNNonlinSol_Newton(y_.get(), context_)));
  }
  check(CVodeSetNonlinearSolver(memory, nonlinear_solver_.get()), "CVodeSetNonlinearSolver");
  if (method == CV_ADAMS) return;
  const sunindextype n = N_VGetLength(y_.get());
  if (n <= largest_dense_size) {
    matrix_.reset(check_allocated(SUNDenseMatrix(n, n, context_)));
    linear_solver_.reset(check_allocated(SUNLinSol_Dense(y_.get(), matrix_.get(), context_)));
  } else {
    linear_solver_.reset(
        check_allocated(SUNLinSol_SPGMR(y_.get(), SUN_PREC_NONE, krylov_dimension, context_)));
  }
  check(CVodeSetLinearSolver(memory, linear_solver_.get(), matrix_.get()), "CVodeSetLinearSolver");
}

/// What CVODE's callbacks share: f(cvode) gives an outcome.
template <class F>
int Cvode::answer(void* self, F&& f) {
  Cvode& cvode = *static_cast<Cvode*>(self);
  // Exceptions must not unwind through C.
  try {
    const Outcome outcome = f(cvode);
    if (outcome == Outcome::converged) return 0;
    cvode.failure_ = outcome;
    cvode.steps_since_failure_ = 0;
    return 1;  // positive: CVODE tries again with a smaller step
  } catch (...) {
    cvode.exception_ = std::current_exception();
    return -1;
  }
}

int Cvode::right_hand_side(sunrealtype t, N_Vector y, N_Vector ydot, void* self) {
  return answer(self, [&](Cvode& cvode) {
    double* rate = N_VGetArrayPointer(ydot);
    if (cvode.size() == 0) *rate = 0.0;
    return cvode.system_.evaluate(t, N_VGetArrayPointer(y), rate);
  });
}

/// The projection of bdf, whose history holds earlier y: CVODE corrects it with y.
int Cvode::projection(sunrealtype t, N_Vector y, N_Vector correction, sunrealtype /*tolerance*/,
                      N_Vector /*error*/, void* self) {
  return answer(self, [&](Cvode& cvode) {
    const double* unprojected = N_VGetArrayPointer(y);
    const Outcome outcome = cvode.project(t, unprojected);
    double* c = N_VGetArrayPointer(correction);
    for (std::size_t i = 0; outcome == Outcome::converged && i < cvode.size(); ++i)
      c[i] = cvode.projected_[i] - unprojected[i];
    return outcome;
  });
}

/// y at time t into projected_.
Outcome Cvode::project(double t, const double* y) {
  projected_.assign(y, y + size());
  return system_->project(t, projected_.data());
}

/// 1 / (rtol scale + atol), or more where the system asks for it. CVODE asks for it at the begin of
/// every step with its own y, the first column of its history, in its hands. For Adams the other
/// columns hold rates alone, so this is where the step is made to start from the projected state.
int Cvode::error_weights(N_Vector y, N_Vector weight, void* self) {
  Cvode& cvode = *static_cast<Cvode*>(self);
  double* value = N_VGetArrayPointer(y);
  if (std::exchange(cvode.write_back_, false)) std::ranges::copy(cvode.state_, value);
  double* own = N_VGetArrayPointer(weight);
  N_VConst(1.0, weight);
  tolerated_errors(*cvode.system_, cvode.options_, {value, cvode.size()}, own);
  N_VInv(weight, weight);
  return 0;
}

void Cvode::start(double t0, std::span<const double> y0) {
  LINKWISE_ASSERT(y0.size() == size(), "y0 has the length of the system");
  state_.assign(y0.begin(), y0.end());
  system_->project(t0, state_.data());
  time_ = t0;
  system_.evaluations = 0;
  counters_ = earlier_ = {};
  failure_ = Outcome::converged;
  restart();
}

/// Begins a new history at time_ and state_.
void Cvode::restart() {
  N_VConst(0.0, y_.get());
  std::copy(state_.begin(), state_.end(), data(y_));
  check(CVodeReInit(memory_.get(), time_, y_.get()), "CVodeReInit");
  earlier_.steps += counters_.steps;
  earlier_.error_test_failures += counters_.error_test_failures;
  earlier_.nonlinear_failures += counters_.nonlinear_failures;
  earlier_.cost += counters_.cost;
  counters_ = {};
  interpolant_valid_ = false;
  restart_needed_ = false;
  write_back_ = false;
}

Outcome Cvode::step(double t_limit) {
  if (options_.max_steps > 0 && earlier_.steps + counters_.steps >= options_.max_steps) {
    return Outcome::too_many_steps;
  }
  if (restart_needed_) restart();
  // Newton's iteration seems to converge where an old matrix is far too large.
  if (method_ == CV_BDF) {
    const bool afresh = system_->has_jumped();
    CVodeSetLSetupFrequency(memory_.get(), afresh ? 1 : 0);
    CVodeSetJacEvalFrequency(memory_.get(), afresh ? 1 : 0);
  }
  const double limit = system_.begin_step(time_);
  check(CVodeSetStopTime(memory_.get(), std::min(limit, never)), "CVodeSetStopTime");
  // CVODE bounds its very first step by a tenth of the distance to this time and ignores it
  // later. It is not t_limit, or the first step would depend on the output times.
  const double reach = options_.max_step > 0.0 ? 10.0 * options_.max_step : 1.0;
  const double horizon = std::min(time_ + reach, limit);
  sunrealtype t = time_;
  int flag = CVode(memory_.get(), horizon, y_.get(), &t, CV_ONE_STEP);
  if (flag >= 0 && counters_.steps == 0 && !moved_to(t)) flag = start_with(limit, horizon, t);
  if (exception_) std::rethrow_exception(std::exchange(exception_, nullptr));
  interpolant_valid_ = false;
  if (flag < 0) return classify(flag);
  if (!all_finite({data(y_), size()})) return Outcome::not_finite;
  // CVODE goes on with steps that round-off swallows; nothing would ever end it.
  if (!moved_to(t)) return no_smaller_step();
  const auto state_at = [this](double at, double* y) {
    check(CVodeGetDky(memory_.get(), at, 0, scratch_.get()), "CVodeGetDky");
    std::copy_n(data(scratch_), size(), y);
  };
  if (system_->retakes(time_, t, data(y_), state_at)) {
    restart();
    return step(t_limit);
  }
  if (const Outcome outcome = take_state(t); outcome != Outcome::converged) return outcome;
  time_ = t;
  ++steps_since_failure_;
  restart_needed_ = t == limit && system_->breaks_at(t);
  interpolant_valid_ = true;
  read_counters();
  system_->accepted(time_, state_.data());
  return Outcome::converged;
}

/// CVODE lets its very first step change no value at rest by more than the absolute tolerance.
/// After a blow late in time this is less than times differ by. A step that is told to it is tested
/// as any other is.
int Cvode::start_with(double limit, double horizon, double& t) {
  restart();
  check(CVodeSetStopTime(memory_.get(), std::min(limit, never)), "CVodeSetStopTime");
  const double smallest = 4096 * std::numeric_limits<double>::epsilon() * std::abs(time_);
  check(CVodeSetInitStep(memory_.get(), std::min(smallest, 0.1 * (horizon - time_))),
        "CVodeSetInitStep");
  t = time_;
  const int flag = CVode(memory_.get(), horizon, y_.get(), &t, CV_ONE_STEP);
  check(CVodeSetInitStep(memory_.get(), 0.0), "CVodeSetInitStep");
  return flag;
}

bool Cvode::moved_to(double t) const {
  return t > time_ + 4.0 * std::numeric_limits<double>::epsilon() * std::abs(time_);
}

/// What CVODE returned at time t, projected, into state_, unless it cannot be projected.
Outcome Cvode::take_state(double t) {
  const double* y = data(y_);
  if (!system_->constrained()) {
    std::copy_n(y, size(), state_.begin());
    return Outcome::converged;
  }
  const Outcome outcome = project(t, y);
  if (outcome != Outcome::converged) return outcome;
  state_.swap(projected_);
  write_back_ = method_ == CV_ADAMS;
  return Outcome::converged;
}

Outcome Cvode::classify(int flag) const {
  switch (flag) {
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
    case CV_TOO_MUCH_ACC:
    case CV_ERR_FAILURE:
    case CV_CONV_FAILURE:
    case CV_LSETUP_FAIL:
    case CV_LSOLVE_FAIL:
    case CV_PROJFUNC_FAIL:
    case CV_REPTD_PROJFUNC_ERR:
    case CV_ILL_INPUT:  // of a step: times too close together to choose one
    case CV_TOO_CLOSE:
      return no_smaller_step();
    default:
      check(flag, "CVode");
      return Outcome::step_too_small;
  }
}

/// Why the steps became too small. In front of a time or state that cannot be evaluated, CVODE
/// creeps up to it with ever smaller steps.
Outcome Cvode::no_smaller_step() const {
  constexpr long recent = 20;
  const bool failed = failure_ != Outcome::converged && steps_since_failure_ <= recent;
  return failed ? failure_ : Outcome::step_too_small;
}

void Cvode::read_counters() {
  void* memory = memory_.get();
  CVodeGetNumSteps(memory, &counters_.steps);
  CVodeGetNumErrTestFails(memory, &counters_.error_test_failures);
  CVodeGetNumNonlinSolvConvFails(memory, &counters_.nonlinear_failures);
  CVodeGetLastStep(memory, &counters_.last_step);
  CVodeGetLastOrder(memory, &counters_.last_order);
  if (method_ == CV_ADAMS) return;
  const int n = static_cast<int>(size());
  long factors = 0, solutions = 0;
  CVodeGetNumLinSolvSetups(memory, &factors);
  CVodeGetNumNonlinSolvIters(memory, &solutions);
  counters_.cost = static_cast<double>(factors) * factor_cost(n) +
                   static_cast<double>(solutions) * solution_cost(n);
}

void Cvode::interpolate(double t, std::span<double> y) {
  LINKWISE_ASSERT(y.size() == size(), "y has the length of the system");
  if (t == time_ || !interpolant_valid_) {
    LINKWISE_ASSERT(t == time_, "there is no step to interpolate in");
    std::copy(state_.begin(), state_.end(), y.begin());
    return;
  }
  check(CVodeGetDky(memory_.get(), t, 0, scratch_.get()), "CVodeGetDky");
  std::copy_n(data(scratch_), y.size(), y.begin());
  system_->project(t, y.data());
}

IntegratorStatistics Cvode::statistics() const {
  IntegratorStatistics result = counters_;
  result.steps += earlier_.steps;
  result.evaluations = system_.evaluations;
  result.error_test_failures += earlier_.error_test_failures;
  result.nonlinear_failures += earlier_.nonlinear_failures;
  result.cost += earlier_.cost + static_cast<double>(system_.evaluations);
  return result;
}

}  // namespace

std::unique_ptr<Integrator> make_plain_adams(OdeSystem& system, const IntegratorOptions& options) {
  return std::make_unique<Cvode>(CV_ADAMS, system, options);
}

std::unique_ptr<Integrator> make_bdf(OdeSystem& system, const IntegratorOptions& options) {
  return std::make_unique<Cvode>(CV_BDF, system, options);
}

}  // namespace linkwise
