#pragma once
// States of a model with leading axes, and the work on them over threads.
#include <algorithm>

#include "arrays.hpp"
#include "interrupt.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/simd/lanes.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {

inline size_t size(int n) { return static_cast<size_t>(n); }

/// q, v, tau and external wrenches with their leading axes broadcast.
struct States {
  Argument q, v, tau, external, prescribed;
  Shape lead;
  size_t count;
  std::vector<double> tau_zero;

  States(const Model& m, nb::handle q_, nb::handle v_, nb::handle tau_, const char* tau_name,
         nb::handle external_, nb::handle prescribed_ = nb::none())
      : q("q", {size(m.nq())}, q_),
        v("v", {size(m.nv())}, v_),
        tau(tau_name, {size(m.nv())}, tau_),
        external("external", {size(m.n_joints()), 6}, external_),
        prescribed("prescribed", {size(m.nv())}, prescribed_) {
    if (!q.given)
      throw InputError("q is missing; give an array of shape (..., " + std::to_string(m.nq()) +
                       ")");
    lead = broadcast_leading({&q, &v, &tau, &external, &prescribed});
    count = product(lead);
  }
};

/// No wrench acts on a body without mass.
inline void check_external(const Model& m, const States& s) {
  if (!s.external.given) return;
  for (int j = 0; j < m.n_joints(); ++j) {
    if (m.joints[j].last_of_body) continue;
    for (size_t i = 0; i < s.count; ++i)
      for (int k = 0; k < 6; ++k)
        if (s.external.data[(i * m.n_joints() + j) * 6 + k] != 0)
          throw InputError(
              "body '" + m.links[m.joints[j].link].name + "'" + m.where() +
              " has no mass, so no wrench can act on it; apply it to the next body outboard");
  }
}

inline void check_prescribed(const Model& m, const States& s) {
  if (s.prescribed.given && m.spec().prescribed.empty())
    throw InputError(
        "prescribed: the model has no joint of given motion; use model.prescribe([...])");
}

/// tau, null for none, with the model's passive forces added, one row a system.
inline std::vector<double> with_passive(const Model& m, const States& s, const double* tau) {
  std::vector<double> total(s.count * m.nv());
  if (tau) std::copy(tau, tau + total.size(), total.begin());
  const std::vector<double> rest(m.nv());
  for (size_t i = 0; i < s.count; ++i)
    add_passive_forces(m, s.q.data + i * m.nq(), s.v.given ? s.v.data + i * m.nv() : rest.data(),
                       total.data() + i * m.nv());
  return total;
}

/// The rows of a batch from `first` on.
inline BatchInput rows_from(const Model& m, const BatchInput& in, size_t first) {
  const auto from = [&](const double* rows, size_t width) {
    return rows ? rows + first * width : nullptr;
  };
  BatchInput part = in;
  part.q = from(in.q, m.nq());
  part.v = from(in.v, m.nv());
  part.tau = from(in.tau, m.nv());
  part.du = from(in.du, m.nv());
  part.passive = from(in.passive, m.nv());
  part.external = from(in.external, 6 * m.n_joints());
  return part;
}

/// f(first, count) on parts of a batch, over threads. Parts end at whole lane groups, so that the
/// grouping, and with it every bit, is that of one thread. Signals are looked at between parts;
/// what they raise is to be passed on with the GIL.
template <class F>
void over_parts(const Model& m, size_t count, int threads, Interrupt& interrupt, F&& f) {
  constexpr size_t worth_a_thread = 512;  // bodies: some 20 us of work
  constexpr size_t most = 1 << 18;        // bodies between two looks at signals: some 10 ms
  const size_t groups = (count + native_lanes - 1) / native_lanes;
  const size_t work = count * m.n_bodies();
  const size_t shares = std::min(static_cast<size_t>(threads), work / worth_a_thread + 1);
  const size_t parts = std::min(groups, std::max(shares, work / most));
  if (parts <= 1) return f(0, count);
  parallel_for(static_cast<int>(parts), threads, [&](int i) {
    if (interrupt()) return;
    const size_t first = groups * i / parts * native_lanes;
    const size_t last = std::min(count, groups * (i + 1) / parts * native_lanes);
    f(first, last - first);
  });
}

}  // namespace linkwise::bindings
