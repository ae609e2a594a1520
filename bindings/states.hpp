#pragma once
// States of a model with leading axes, and the work on them over threads.
#include "interrupt.hpp"
#include "linkwise/simulate/given_motion.hpp"
#include "numbers.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {

inline size_t size(int n) { return static_cast<size_t>(n); }

/// q, v, tau and external wrenches with their leading axes broadcast.
struct States {
  Argument q, v, tau, external, prescribed, loop_tau, loop_prescribed;
  Shape lead;
  size_t count;

  States(const Model& m, nb::handle q_, nb::handle v_, nb::handle tau_, const char* tau_name,
         nb::handle external_, nb::handle prescribed_ = nb::none(),
         nb::handle loop_tau_ = nb::none(), nb::handle loop_prescribed_ = nb::none())
      : q("q", {size(m.nq())}, q_),
        v("v", {size(m.nv())}, v_),
        tau(tau_name, {size(m.nv())}, tau_),
        external("external", {size(m.n_joints()), 6}, external_),
        prescribed("prescribed", {size(m.nv())}, prescribed_),
        loop_tau("loop_tau", {size(m.loops.nv)}, loop_tau_),
        loop_prescribed("loop_prescribed", {size(m.loops.nv)}, loop_prescribed_) {
    if (!q.given)
      throw InputError("q is missing; give an array of shape (..., " + std::to_string(m.nq()) +
                       ")");
    lead = broadcast_leading({&q, &v, &tau, &external, &prescribed, &loop_tau, &loop_prescribed});
    count = product(lead);
    for (size_t i = 0; i < count; ++i) check_quaternions(m, q.data + i * m.nq());
  }

  /// As the core takes them; absent ones are null.
  BatchInput input() const {
    BatchInput in;
    in.q = q.data;
    in.v = v.data;
    in.tau = tau.data;
    in.external = external.data;
    in.prescribed = prescribed.data;
    in.loop_tau = loop_tau.data;
    in.loop_prescribed = loop_prescribed.data;
    return in;
  }
};

/// Runs f(go_on) without the GIL; afterwards, what a signal's handler raised meanwhile is raised.
template <class F>
auto without_gil(F&& f) {
  Interrupt interrupt;
  const GoOn go_on = [&interrupt] { return !interrupt(); };
  if constexpr (std::is_void_v<decltype(f(go_on))>) {
    {
      const GilReleased released;
      f(go_on);
    }
    interrupt.rethrow();
  } else {
    auto result = [&] {
      const GilReleased released;
      return f(go_on);
    }();
    interrupt.rethrow();
    return result;
  }
}

}  // namespace linkwise::bindings
