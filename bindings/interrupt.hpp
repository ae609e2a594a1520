#pragma once
// Ctrl-C while the core computes without the GIL.
#include <atomic>
#include <chrono>
#include <thread>

#include "gil.hpp"

namespace linkwise::bindings {

/// Made with the GIL held, then asked from the loops of the core, from any thread and without the
/// GIL. Python's signal handlers run while it is asked by the thread that made it.
class Interrupt {
 public:
  /// Has a handler raised an exception? From then on always true.
  bool operator()() {
    if (raised_.load(std::memory_order_relaxed)) return true;
    if (std::this_thread::get_id() != caller_) return false;
    const Clock::time_point now = Clock::now();
    if (now < next_) return false;
    next_ = now + pause;
    const GilHeld held;
    if (PyErr_CheckSignals() != 0) raised_.store(true, std::memory_order_relaxed);
    return raised_.load(std::memory_order_relaxed);
  }

  /// With the GIL: passes the exception on, if there is one.
  void rethrow() const {
    if (raised_.load(std::memory_order_relaxed)) throw nanobind::python_error();
  }

  /// With the GIL: was it a KeyboardInterrupt? Then it is forgotten; others are passed on.
  bool was_keyboard() const {
    if (!raised_.load(std::memory_order_relaxed)) return false;
    if (!PyErr_ExceptionMatches(PyExc_KeyboardInterrupt)) rethrow();
    PyErr_Clear();
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds pause{50};
  std::atomic<bool> raised_{false};
  const std::thread::id caller_ = std::this_thread::get_id();
  Clock::time_point next_ = Clock::now() + pause;
};

}  // namespace linkwise::bindings
