/// The static libraries of the sundials4py wheel call these when an object is destroyed, to release
/// what the wheel's own Python binding attached to it. We attach nothing, so they do nothing.
#if defined(LINKWISE_SUNDIALS_BINDING_HOOKS)

extern "C" {
void SUNContextFunctionTable_Destroy(void*);
void SUNDomEigEstimatorFunctionTable_Destroy(void*);
void SUNLinearSolverFunctionTable_Destroy(void*);
void SUNLoggerFunctionTable_Destroy(void*);
void SUNNonlinearSolverFunctionTable_Destroy(void*);
void SUNStepperFunctionTable_Destroy(void*);
void arkode_user_supplied_fn_table_destroy(void*);
void cvode_user_supplied_fn_table_destroy(void*);
void mristepinnerstepper_user_supplied_fn_table_destroy(void*);

void SUNContextFunctionTable_Destroy(void*) {}
void SUNDomEigEstimatorFunctionTable_Destroy(void*) {}
void SUNLinearSolverFunctionTable_Destroy(void*) {}
void SUNLoggerFunctionTable_Destroy(void*) {}
void SUNNonlinearSolverFunctionTable_Destroy(void*) {}
void SUNStepperFunctionTable_Destroy(void*) {}
void arkode_user_supplied_fn_table_destroy(void*) {}
void cvode_user_supplied_fn_table_destroy(void*) {}
void mristepinnerstepper_user_supplied_fn_table_destroy(void*) {}
}

#endif
