#pragma once
// Newton's linear systems (I - gamma J) x = b where the system solves its own stiff part: by that
// alone, which leaves the rest of J to Newton's iterations, or by GMRES that it preconditions,
// where these do not converge. The former takes no evaluation, GMRES one in each of its iterations.
#include <memory>
#include <new>

#include <sundials/sundials_linearsolver.h>
#include <sunlinsol/sunlinsol_spgmr.h>

#include "linkwise/integrate/sundials/handles.hpp"

namespace linkwise::sundials {

class StiffSolver {
 public:
  /// y: a vector of the system's length.
  StiffSolver(N_Vector y, int krylov_dimension, SUNContext context)
      : krylov_(check_allocated(SUNLinSol_SPGMR(y, SUN_PREC_LEFT, krylov_dimension, context))),
        handle_(check_allocated(SUNLinSolNewEmpty(context))) {
    handle_->content = this;
    SUNLinearSolver_Ops ops = handle_->ops;
    ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_ITERATIVE; };
    ops->setatimes = [](SUNLinearSolver s, void* data, SUNATimesFn times) {
      return SUNLinSolSetATimes(of(s).krylov_.get(), data, times);
    };
    ops->setpreconditioner = [](SUNLinearSolver s, void* data, SUNPSetupFn setup,
                                SUNPSolveFn solve) {
      StiffSolver& self = of(s);
      self.data_ = data;
      self.solve_ = solve;
      return SUNLinSolSetPreconditioner(self.krylov_.get(), data, setup, solve);
    };
    ops->setscalingvectors = [](SUNLinearSolver s, N_Vector left, N_Vector right) {
      return SUNLinSolSetScalingVectors(of(s).krylov_.get(), left, right);
    };
    ops->setzeroguess = [](SUNLinearSolver s, sunbooleantype is_zero) {
      return SUNLinSolSetZeroGuess(of(s).krylov_.get(), is_zero);
    };
    ops->initialize = [](SUNLinearSolver s) { return SUNLinSolInitialize(of(s).krylov_.get()); };
    ops->setup = [](SUNLinearSolver s, SUNMatrix A) {
      return SUNLinSolSetup(of(s).krylov_.get(), A);
    };
    ops->solve = [](SUNLinearSolver s, SUNMatrix A, N_Vector x, N_Vector b, sunrealtype tolerance) {
      StiffSolver& self = of(s);
      if (self.iterates) return SUNLinSolSolve(self.krylov_.get(), A, x, b, tolerance);
      return self.solve_(self.data_, b, x, tolerance, SUN_PREC_LEFT);
    };
    ops->numiters = [](SUNLinearSolver s) {
      return of(s).iterates ? SUNLinSolNumIters(of(s).krylov_.get()) : 0;
    };
    ops->resnorm = [](SUNLinearSolver s) {
      return of(s).iterates ? SUNLinSolResNorm(of(s).krylov_.get()) : 0.0;
    };
    ops->free = [](SUNLinearSolver s) {
      s->content = nullptr;
      SUNLinSolFreeEmpty(s);
      return 0;
    };
  }
  StiffSolver(const StiffSolver&) = delete;
  StiffSolver& operator=(const StiffSolver&) = delete;

  SUNLinearSolver get() const { return handle_.get(); }

  bool iterates = false;  ///< by GMRES

 private:
  static StiffSolver& of(SUNLinearSolver s) { return *static_cast<StiffSolver*>(s->content); }

  LinearSolverHandle krylov_, handle_;
  void* data_ = nullptr;
  SUNPSolveFn solve_ = nullptr;
};

}  // namespace linkwise::sundials
