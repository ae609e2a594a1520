// How far what loop joints join is apart, and their coordinates.
#include <algorithm>

#include <nanobind/nanobind.h>

#include "bind.hpp"
#include "linkwise/kinematics/loop_states.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {

void bind_loop_gaps(nb::module_& m) {
  m.def(
      "loop_gaps",
      [](const PyModel& self, nb::handle q) {
        const Model& model = *self.model;
        const States s(model, q, nb::none(), nb::none(), "tau", nb::none());
        NewArray out(s.lead, {size(model.n_loops()), 2});
        without_gil([&](const GoOn& go_on) {
          LoopStates loops(model);
          double* gap = out.data;
          for (size_t i = 0; i < s.count && go_on(); ++i) {
            SweepInput<double> in;
            in.q = s.q.data + i * size(model.nq());
            loops.update(in);
            for (int l = 0; l < model.n_loops(); ++l, gap += 2) {
              const LoopMiss miss = miss_of(loops[l], loops[l].gap);
              gap[0] = miss.shift;
              gap[1] = miss.turn;
            }
          }
        });
        check_result(out.data, s.count * size(model.n_loops()) * 2);
        return out.array;
      },
      "model"_a, "q"_a,
      R"(How far each joint that closes a loop is from closing it (..., n_loops, 2) [m, rad]: by a
shift and by a turn, of what the joint holds together. Both are zero where q closes all loops.

Args:
    model: the mechanism.
    q: positions (..., nq) [rad, m].

Raises:
    InputError: q has another shape.
    NumericsError: a gap is not finite.)");
  m.def(
      "loop_coordinates",
      [](const PyModel& self, nb::handle q, nb::handle v) {
        const Model& model = *self.model;
        const States s(model, q, v, nb::none(), "tau", nb::none());
        NewArray positions(s.lead, {size(model.loops.nq)}), rates(s.lead, {size(model.loops.nv)});
        without_gil([&](const GoOn& go_on) {
          LoopStates loops(model);
          for (size_t i = 0; i < s.count && go_on(); ++i) {
            SweepInput<double> in;
            in.q = s.q.data + i * size(model.nq());
            in.v = s.v.given ? s.v.data + i * size(model.nv()) : nullptr;
            loops.update(in);
            std::copy(loops.q().begin(), loops.q().end(), positions.data + i * loops.q().size());
            std::copy(loops.v().begin(), loops.v().end(), rates.data + i * loops.v().size());
          }
        });
        return nb::make_tuple(positions.array, rates.array);
      },
      "model"_a, "q"_a, "v"_a.none() = nb::none(),
      R"(Coordinates (..., sum of loop joints' nq) [rad, m] and rates (..., sum of their nv) of the joints
that close loops, in the order of model.loop_names; model.loop_slices says which are whose. Of the
coordinates they are those that come closest to the pose of what the joint joins, angles within half
a turn of zero.

Args:
    model: the mechanism.
    q: positions (..., nq) [rad, m].
    v: rates (..., nv) [rad/s, m/s]; None: at rest.

Raises:
    InputError: q or v has another shape.)");
}

}  // namespace linkwise::bindings
