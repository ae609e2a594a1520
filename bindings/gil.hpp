#pragma once
// Taking the GIL and running Python's code, in threads that outlive the interpreter.
//
// When the interpreter shuts down, Python before 3.14 ends every other thread that asks for the
// GIL: pthread_exit unwinds its frames. In frames of C++ that ends the process instead, at the
// first function that is noexcept or catches everything, and destructors would touch objects
// without the GIL. So such a thread sleeps here until the process ends, as Python 3.14 has it.
#include <chrono>
#include <thread>
#include <utility>

#include <nanobind/nanobind.h>

#ifdef __GLIBCXX__
#include <cxxabi.h>
#endif

namespace linkwise::bindings {

[[noreturn]] inline void sleep_until_the_process_ends() {
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

/// f(), which may ask for the GIL; it returns only while there is an interpreter. Between f and
/// Python's own functions there should be no object with a destructor.
template <class F>
auto outliving_python(F&& f) {
#ifdef __GLIBCXX__
  try {
    return f();
  } catch (abi::__forced_unwind&) {
    sleep_until_the_process_ends();
  }
#else
  return f();
#endif
}

/// The state of this thread where GilReleased released it. PyGILState_Ensure knows it as well, but
/// may not be asked any more once the interpreter is gone.
inline constinit thread_local PyThreadState* released_state = nullptr;

/// While it lives, the GIL is released.
class GilReleased {
 public:
  GilReleased() { released_state = PyEval_SaveThread(); }
  ~GilReleased() {
    PyThreadState* const state = std::exchange(released_state, outer_);
    outliving_python([state] { PyEval_RestoreThread(state); });
  }
  GilReleased(const GilReleased&) = delete;
  GilReleased& operator=(const GilReleased&) = delete;

 private:
  PyThreadState* const outer_ = released_state;
};

/// While it lives, the GIL is held: for what the core asks of Python.
class GilHeld {
 public:
  GilHeld() {
    if (state_)
      outliving_python([this] { PyEval_RestoreThread(state_); });
    else
      outliving_python([this] { ensured_ = PyGILState_Ensure(); });
  }
  ~GilHeld() {
    if (state_)
      released_state = PyEval_SaveThread();
    else
      PyGILState_Release(ensured_);
  }
  GilHeld(const GilHeld&) = delete;
  GilHeld& operator=(const GilHeld&) = delete;

 private:
  PyThreadState* const state_ = std::exchange(released_state, nullptr);
  PyGILState_STATE ensured_{};
};

/// A function in Python.
class PythonFunction {
 public:
  explicit PythonFunction(nanobind::object function) : function_(std::move(function)) {}

  template <class... Arguments>
  nanobind::object operator()(Arguments&&... arguments) const {
    return outliving_python(
        [&]() -> nanobind::object { return function_(std::forward<Arguments>(arguments)...); });
  }

  PyObject* ptr() const { return function_.ptr(); }
  void forget() { const nanobind::object last = std::move(function_); }

 private:
  nanobind::object function_;
};

}  // namespace linkwise::bindings
