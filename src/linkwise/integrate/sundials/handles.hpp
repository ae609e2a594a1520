#pragma once

#include <sundials/sundials_config.h>

#if defined(LINKWISE_SUNDIALS_CVODES)
#include <cvodes/cvodes.h>
#else
#include <cvode/cvode.h>
#endif
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>

#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sundials/sundials_logger.h>
#include <sundials/sundials_matrix.h>
#include <sundials/sundials_nonlinearsolver.h>

/// Owners of SUNDIALS' objects. An owner of the context must be destroyed last.
namespace linkwise::sundials {

inline void check(int flag, const char* function) {
  if (flag == CV_SUCCESS) return;
  throw std::runtime_error(std::string("SUNDIALS: ") + function + " returned " +
                           std::to_string(flag));
}

template <class T>
T* check_allocated(T* object) {
  if (object == nullptr) throw std::bad_alloc();
  return object;
}

/// A context that keeps quiet: failures reach the caller as return values, not on stderr.
class Context {
 public:
  Context() {
#if SUNDIALS_VERSION_MAJOR >= 7
    check(SUNContext_Create(SUN_COMM_NULL, &context_), "SUNContext_Create");
    check(SUNContext_ClearErrHandlers(context_), "SUNContext_ClearErrHandlers");
#else
    check(SUNContext_Create(nullptr, &context_), "SUNContext_Create");
#endif
    SUNLogger logger = nullptr;
    if (SUNContext_GetLogger(context_, &logger) == 0 && logger != nullptr) {
      SUNLogger_SetErrorFilename(logger, "");
      SUNLogger_SetWarningFilename(logger, "");
    }
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ~Context() { SUNContext_Free(&context_); }

  operator SUNContext() const { return context_; }

 private:
  SUNContext context_ = nullptr;
};

template <auto function>
struct Destroy {
  template <class T>
  void operator()(T* object) const {
    function(object);
  }
};

inline void free_memory(void* memory) { CVodeFree(&memory); }

using Memory = std::unique_ptr<void, Destroy<free_memory>>;
using Vector = std::unique_ptr<std::remove_pointer_t<N_Vector>, Destroy<N_VDestroy>>;
using Matrix = std::unique_ptr<std::remove_pointer_t<SUNMatrix>, Destroy<SUNMatDestroy>>;
using LinearSolverHandle =
    std::unique_ptr<std::remove_pointer_t<SUNLinearSolver>, Destroy<SUNLinSolFree>>;
using NonlinearSolverHandle =
    std::unique_ptr<std::remove_pointer_t<SUNNonlinearSolver>, Destroy<SUNNonlinSolFree>>;

}  // namespace linkwise::sundials
