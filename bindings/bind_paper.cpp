// What `linkwise paper` times inside an evaluation, and nothing else uses: the part of the method
// of constraint forces that no number of processors shortens, T_serial of [sharf1993, eqs. (20),
// (21)]. With one processor per body, everything about a body or a joint is done at once, save
// - the sums of the iteration (inner products, norms): one number per body, added up one by one;
// - with joint coordinates as the state, passing velocities outward from body to body. The paper's
//   own state, the bodies' absolute velocities, needs no such pass.
#include <chrono>

#include <nanobind/nanobind.h>

#include "arrays.hpp"
#include "bind.hpp"
#include "linkwise/kinematics/body_state.hpp"
#include "py_model.hpp"

namespace linkwise::bindings {
namespace {

/// Seconds of one of `repeats` calls.
template <class Call>
double seconds_each(int repeats, Call&& call) {
  const auto started = std::chrono::steady_clock::now();
  for (int k = 0; k < repeats; ++k) call();
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - started;
  return spent.count() / repeats;
}

nb::dict measure_serial_part(const PyModel& self, nb::handle q, nb::handle v, int sums,
                             int repeats) {
  if (sums < 0 || repeats < 1) throw InputError("sums must be >= 0 and repeats >= 1");
  const Model& model = *self.model;
  const Argument positions("q", {static_cast<size_t>(model.nq())}, q);
  const Argument rates("v", {static_cast<size_t>(model.nv())}, v);
  if (!positions.given || !rates.given) throw InputError("q or v is missing; give both");
  SweepInput<double> in;
  in.q = positions.data;
  in.v = rates.data;
  const int n = model.n_bodies();
  std::vector<BodyState<double>> state(n);
  std::vector<GeneralState<double>> general(model.n_general);
  calc_body_states(model, in, state.data(), general.data());
  // The bodies' own shares, which their processors have ready.
  std::vector<Motion<double>> own(n), velocity(n);
  std::vector<double> partial(n);
  for (int i = 0; i < n; ++i) {
    const int parent = model.topology[i].parent;
    const Motion<double> carried = parent >= 0 ? state[i].X * state[parent].v : Motion<double>{};
    own[i] = {state[i].v.lin - carried.lin, state[i].v.ang - carried.ang};
    partial[i] = 1.0 / (i + 1);
  }

  // What the compiler cannot foresee, so that it keeps the loops.
  volatile double input = 1e-300, result = 0;
  nb::dict seconds;
  seconds["sums"] = seconds_each(repeats, [&] {
    for (int s = 0; s < sums; ++s) {
      double sum = input;
      for (int i = 0; i < n; ++i) sum += partial[i];
      result = sum;
    }
  });
  seconds["velocities"] = seconds_each(repeats, [&] {
    own[0].ang.x += input;
    for (int i = 0; i < n; ++i) {
      const int parent = model.topology[i].parent;
      velocity[i] = own[i];
      if (parent >= 0) velocity[i] += state[i].X * velocity[parent];
    }
    result = velocity[n - 1].ang.x;
  });
  static_cast<void>(result);
  return seconds;
}

}  // namespace

void bind_paper(nb::module_& m) {
  m.def("measure_serial_part", &measure_serial_part, "model"_a, "q"_a, "v"_a, nb::kw_only(),
        "sums"_a, "repeats"_a = 1000,
        "Seconds of what no number of processors shortens in an evaluation by constraint forces:\n"
        "adding one number per body `sums` times, and passing the velocities from body to body.");
}

}  // namespace linkwise::bindings
