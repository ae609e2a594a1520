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

nb::object mask(const Found& found, const std::vector<char>& marks) {
  NewArray out({found.n_loads}, {6});
  std::copy(marks.begin(), marks.end(), out.data);
  return read_only(out.array.attr("astype")("bool"));
}

nb::object stresses(const Found& found, int count, const std::vector<double>& loads) {
  NewArray out({size(count)}, {found.n_loads, 6});
  std::copy(loads.begin(), loads.end(), out.data);
  return read_only(out.array);
}

}  // namespace

void bind_indeterminacy(nb::module_& m) {
  nb::class_<Found>(m, "Indeterminacy",
                    "Which joint loads of closed loops rigid bodies and bearings determine.")
      .def_prop_ro(
          "rows", [](const Found& f) { return f.all.rows; },
          "Directions that the joints which close loops hold.")
      .def_prop_ro(
          "rank", [](const Found& f) { return f.all.rank; }, "How many of them are independent.")
      .def_prop_ro(
          "mobility", [](const Found& f) { return f.all.mobility; },
          "Degrees of freedom that are left.")
      .def_prop_ro(
          "determinate", [](const Found& f) { return mask(f, f.all.determinate); },
          nb::rv_policy::move,
          "(n_joints + n_loops, 6) [bool]: whether a component of a joint load is determinate, by "
          "rigid bodies\nor by bearings.")
      .def_prop_ro(
          "by_bearings", [](const Found& f) { return mask(f, f.all.by_bearings); },
          nb::rv_policy::move,
          "(n_joints + n_loops, 6) [bool]: those that are determinate because bearings decide "
          "them.")
      .def_prop_ro(
          "couplings",
          [](const Found& f) {
            NewArray out({f.all.couplings.size()}, {});
            std::copy(f.all.couplings.begin(), f.all.couplings.end(), out.data);
            return read_only(out.array.attr("astype")("bool"));
          },
          nb::rv_policy::move,
          "(couplings,) [bool]: whether the load of each coupling is determinate.")
      .def_prop_ro(
          "self_stresses",
          [](const Found& f) { return stresses(f, f.all.n_self_stresses, f.all.self_stresses); },
          nb::rv_policy::move,
          "(rows - rank, n_joints + n_loops, 6) [N, N m]: joint loads of forces that "
          "cancel inside the\nloops; any multiple of them may be added to the loads of rigid "
          "bodies.")
      .def_prop_ro(
          "undecided",
          [](const Found& f) { return stresses(f, f.all.n_undecided, f.all.undecided); },
          nb::rv_policy::move,
          "(..., n_joints + n_loops, 6) [N, N m]: those of them that no bearing decides; all of a "
          "model\nwithout bearings.");
  m.def("indeterminacy", &indeterminacy, "model"_a, "q"_a,
        R"(Which components of joint loads follow from rigid bodies and bearings, where loops are
held more than once [wojtyra2005].

Args:
    model: the machine.
    q: a position (nq,) [rad, m] that closes its loops.

Returns:
    Indeterminacy.

Raises:
    InputError: q leaves a loop open, or does not fit the model.)");
}

}  // namespace linkwise::bindings
