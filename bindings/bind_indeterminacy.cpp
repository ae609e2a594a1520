#include "bind.hpp"
#include "linkwise/dynamics/indeterminacy.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

struct Found {
  Indeterminacy all;
  size_t n_loads;
};

Found indeterminacy(const PyModel& self, nb::handle q) {
  const States s(*self.model, q, nb::none(), nb::none(), "tau", nb::none());
  if (!s.lead.empty()) throw InputError("q has leading axes; give one position (nq,)");
  return {find_indeterminacy(*self.model, s.q.data), size(self.model->n_loads())};
}

nb::object determinate(const Found& found) {
  NewArray out({found.n_loads}, {6});
  std::copy(found.all.determinate.begin(), found.all.determinate.end(), out.data);
  return read_only(out.array.attr("astype")("bool"));
}

nb::object self_stresses(const Found& found) {
  NewArray out({size(found.all.n_self_stresses)}, {found.n_loads, 6});
  std::copy(found.all.self_stresses.begin(), found.all.self_stresses.end(), out.data);
  return read_only(out.array);
}

}  // namespace

void bind_indeterminacy(nb::module_& m) {
  nb::class_<Found>(m, "Indeterminacy", "Which joint loads of closed loops rigid bodies determine.")
      .def_prop_ro(
          "rows", [](const Found& f) { return f.all.rows; },
          "Directions that the joints which close loops hold.")
      .def_prop_ro(
          "rank", [](const Found& f) { return f.all.rank; }, "How many of them are independent.")
      .def_prop_ro(
          "mobility", [](const Found& f) { return f.all.mobility; },
          "Degrees of freedom that are left.")
      .def_prop_ro(
          "determinate", &determinate, nb::rv_policy::move,
          "(n_joints + n_loops, 6) [bool]: whether a component of a joint load is determinate.")
      .def_prop_ro("self_stresses", &self_stresses, nb::rv_policy::move,
                   "(rows - rank, n_joints + n_loops, 6) [N, N m]: joint loads of forces that "
                   "cancel inside the\nloops; any multiple of them may be added to the loads.");
  m.def("indeterminacy", &indeterminacy, "model"_a, "q"_a,
        R"(Which components of joint loads follow from rigid bodies alone, where loops are held
more than once [wojtyra2005].

Args:
    model: the machine.
    q: a position (nq,) [rad, m] that closes its loops.

Returns:
    Indeterminacy.

Raises:
    InputError: q leaves a loop open, or does not fit the model.)");
}

}  // namespace linkwise::bindings
