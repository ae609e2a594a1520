// Many simulations in one call.
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "bind.hpp"
#include "linkwise/simulate/batch_simulation.hpp"
#include "py_simulation.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

/// The rows [member][...] of one argument of simulate_batch.
const double* rows_of(const Argument& argument, size_t members) {
  if (!argument.given) return nullptr;
  if (argument.array.ndim() != 1 + argument.tail.size() || argument.array.shape(0) != members)
    throw InputError(std::string(argument.name) + " has shape " +
                     shape_text(shape_of(argument.array)) + "; give a row for each of " +
                     std::to_string(members) + " members");
  return argument.data;
}

nb::dict simulate_members(nb::list simulations, nb::handle q0, nb::handle v0, nb::handle tau,
                          nb::handle times_in, nb::handle quantities, nb::handle threads) {
  std::vector<const Simulation*> all;
  for (nb::handle item : simulations) all.push_back(&nb::cast<PySimulation&>(item).simulation);
  if (all.empty()) throw InputError("there is no model; give at least one");
  const Model& m = all[0]->model();
  const Argument q("q0", {size(m.nq())}, q0), v("v0", {size(m.nv())}, v0),
      torque("tau", {size(m.nv())}, tau), times("times", {}, times_in);
  const size_t members = q.array.shape(0), n = times.array.size(), per = members / all.size();
  const BatchStart start{rows_of(q, members), rows_of(v, members), rows_of(torque, members)};
  Sample out;
  nb::dict columns;
  const auto column = [&](const char* quantity, const char* name, const Shape& tail, double*& to) {
    if (!nb::cast<bool>(quantities.attr("__contains__")(quantity))) return;
    const NewArray made({members, n}, tail);
    columns[name] = made.array;
    to = made.data;
  };
  const Shape coordinates{size(m.nq())}, rates{size(m.nv())}, wrenches{size(m.n_joints()), 6};
  column("position", "position", coordinates, out.position);
  column("velocity", "velocity", rates, out.velocity);
  column("acceleration", "acceleration", rates, out.acceleration);
  column("joint_load", "joint_load", wrenches, out.joint_load);
  column("drive_torque", "drive_torque", rates, out.drive_torque);
  column("energy", "kinetic_energy", {}, out.kinetic_energy);
  column("energy", "potential_energy", {}, out.potential_energy);
  const int team = threads_of(threads, 1 << 20);
  Interrupt interrupt;
  std::vector<Ending> ends;
  {
    const nb::gil_scoped_release release;
    ends = simulate_batch(all, per, start, {times.data, n}, out, team,
                          [&interrupt] { return !interrupt(); });
  }
  columns["interrupted"] = interrupt.was_keyboard();
  NewArray end_times({members});
  nb::list outcomes;
  for (size_t i = 0; i < members; ++i) {
    end_times.data[i] = ends[i].time;
    outcomes.append(std::string(to_string(ends[i].outcome)));
  }
  columns["outcome"] = outcomes;
  columns["stop_time"] = end_times.array;
  return columns;
}

}  // namespace

void bind_batch_simulation(nb::module_& m) {
  m.def("simulate_members", &simulate_members, "simulations"_a, nb::kw_only(), "q0"_a, "v0"_a,
        "tau"_a.none(), "times"_a, "quantities"_a, "threads"_a = nb::none(),
        "The loop behind linkwise.simulate_batch: rows (member, ...), members of one simulation "
        "next to each other.");
}

}  // namespace linkwise::bindings
