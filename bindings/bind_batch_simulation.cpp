// Many simulations in one call.
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include "bind.hpp"
#include "linkwise/simulate/batch_simulation.hpp"
#include "py_simulation.hpp"
#include "samples.hpp"
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

nb::tuple simulate_members(nb::list simulations, nb::handle q0, nb::handle v0, nb::handle tau,
                           nb::handle times_in, nb::handle quantities, nb::handle threads) {
  std::vector<const Simulation*> all;
  for (nb::handle item : simulations) all.push_back(&nb::cast<PySimulation&>(item).simulation);
  if (all.empty()) throw InputError("there is no model; give at least one");
  const Model& m = all[0]->model();
  const Argument q("q0", {size(m.nq())}, q0), v("v0", {size(m.nv())}, v0),
      torque("tau", {size(m.nv())}, tau), times("times", {}, times_in);
  const size_t members = q.array.shape(0), n = times.array.size();
  if (members % all.size() != 0)
    throw InputError("q0 has " + std::to_string(members) + " rows for " +
                     std::to_string(all.size()) +
                     " simulations; give each simulation the same number of rows");
  const Start start{rows_of(q, members), rows_of(v, members), rows_of(torque, members), members};
  const Columns columns(m, {members, n}, quantities);
  const bool keep = !all[0]->directions().empty();
  const NewArray extremes({members}, {keep ? Extremes::size(m) : 0});
  const Executor executor = executor_for(whole_number(threads, "threads"));
  Interrupt interrupt;
  std::vector<Ending> endings;
  MemberNotes notes;
  {
    const GilReleased released;
    endings = simulate_batch(
        all, start, {times.data, n}, columns.sample, executor,
        [&interrupt] { return !interrupt(); }, keep ? extremes.data : nullptr, &notes);
  }
  const bool interrupted = interrupt.was_keyboard();
  nb::list ends;
  for (Ending& ending : endings) ends.append(nb::cast(std::move(ending)));
  nb::list loops;
  for (const LoopNotes& note : notes.loops)
    loops.append(nb::make_tuple(note.assembled, note.doubt));
  const ForcesOfMembers& forces = notes.forces;
  return nb::make_tuple(columns.to_python(members), extremes.array, ends, interrupted,
                        nb::make_tuple(forces.members, forces.worst, forces.text), loops);
}

}  // namespace

void bind_batch_simulation(nb::module_& m) {
  m.def("simulate_members", &simulate_members, "simulations"_a, nb::kw_only(), "q0"_a, "v0"_a,
        "tau"_a.none(), "times"_a, "quantities"_a, "threads"_a = nb::none(),
        "The loop behind linkwise.simulate_batch: rows (member, ...), members of one simulation "
        "next to each other.\n"
        "(arrays by name, extremes (member, ...) where the simulations keep them, endings, "
        "interrupted by Ctrl-C,\n"
        "(members whose forces of large gain are not known well, the worst one, what is said of "
        "it),\n"
        "of each member what closing its loops moved at the start, and where their loads have no "
        "bound).");
}

}  // namespace linkwise::bindings
