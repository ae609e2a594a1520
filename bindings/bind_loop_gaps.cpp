// How far what loop joints join is apart, and their coordinates and accelerations.
#include <algorithm>

#include <nanobind/nanobind.h>

#include "bind.hpp"
#include "linkwise/dynamics/bearing_shares.hpp"
#include "linkwise/dynamics/loop_rates.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

void bind_accelerations(nb::module_& m) {
  m.def(
      "loop_accelerations",
      [](const PyModel& self, nb::handle q, nb::handle v, nb::handle a) {
        const Model& model = *self.model;
        const States s(model, q, v, a, "acceleration", nb::none());
        NewArray out(s.lead, {size(model.loops.nv)});
        const std::vector<double> rest(model.nv());
        without_gil([&](const GoOn& go_on) {
          LoopRates loops(model);
          const auto row = [&](const Argument& x, size_t i) {
            return x.given ? x.data + i * rest.size() : rest.data();
          };
          for (size_t i = 0; i < s.count && go_on(); ++i) {
            const auto found =
                loops.accelerations(s.q.data + i * size(model.nq()), row(s.v, i), row(s.tau, i));
            std::copy(found.begin(), found.end(), out.data + i * found.size());
          }
        });
        check_result(out.data, s.count * size(model.loops.nv));
        return out.array;
      },
      "model"_a, "q"_a, "v"_a.none(), "acceleration"_a.none(),
      R"(Accelerations (..., sum of loop joints' nv) [rad/s2, m/s2] of the joints that close loops: the
derivatives of the rates of loop_coordinates. Those of the joints that Model.prescribe names are 0.

Args:
    model: the mechanism.
    q: positions (..., nq) [rad, m].
    v: rates (..., nv) [rad/s, m/s]; None: at rest.
    acceleration: dv/dt (..., nv) [rad/s2, m/s2] of the joints of the tree; None: 0.

Raises:
    InputError: q, v or the accelerations have another shape.
    NumericsError: a result is not finite.)");
}

void bind_preload_forces(nb::module_& m) {
  m.def(
      "preload_forces",
      [](const PyModel& self, nb::handle q) {
        const Model& model = *self.model;
        const States s(model, q, nb::none(), nb::none(), "tau", nb::none());
        NewArray out(s.lead, {size(model.n_loads()), 3});
        without_gil([&](const GoOn& go_on) {
          LoopStates loops(model);
          double* force = out.data;
          for (size_t i = 0; i < s.count && go_on(); ++i) {
            SweepInput<double> in;
            in.q = s.q.data + i * size(model.nq());
            loops.update(in);
            for (const Vec3<double>& f : preload_forces(model, in.q, loops)) {
              *force++ = f.x;
              *force++ = f.y;
              *force++ = f.z;
            }
          }
        });
        return out.array;
      },
      "model"_a, "q"_a,
      R"(Forces that the preloads of bearings put on the child link, in the axes of the joint's load.

Args:
    model: the machine.
    q: coordinates (..., nq) [rad, m].

Returns:
    (..., n_joints + n_loops, 3) [N], zero for joints without a preload: of a rod along itself, of
    others the preload as given, turned with the child.

Raises:
    InputError: q has another shape.)");
}

}  // namespace

void bind_loop_gaps(nb::module_& m) {
  bind_preload_forces(m);
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
  bind_accelerations(m);
}

}  // namespace linkwise::bindings
