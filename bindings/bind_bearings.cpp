// What joints yield to their loads and do not fit by: bearings of a Model.
#include <cmath>

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include "joint_lists.hpp"
#include "vectors.hpp"

namespace linkwise::bindings {
namespace {

/// One number is along the bearing's axis, three are in the parent's axes of the joint.
void set_along_or_all(nb::handle given, const std::string& name, double& along, Vec3<double>& all) {
  if (given.is_none()) return;
  const ArrayIn array = as_array(given, name.c_str());
  if (array.ndim() == 0)
    along = *array.data();
  else
    all = vec3(given, name.c_str());
}

/// The same machine with a joint that yields to its load.
PyModel* with_bearing(const PyModel& self, const std::string& joint, nb::handle radial,
                      nb::handle axial, nb::handle tilt, nb::handle torsion, nb::handle axis,
                      nb::handle offset, nb::handle turn, nb::handle preload) {
  ModelSpec spec = self.model->spec();
  const std::string head = "bearing of joint '" + joint + "': ";
  BearingSpec bearing{joint};
  const auto set = [&](nb::handle given, const char* name, double& to) {
    if (!given.is_none()) to = real_number(given, (head + name).c_str());
  };
  set(radial, "radial", bearing.radial);
  set(axial, "axial", bearing.axial);
  set(tilt, "tilt", bearing.tilt);
  set(torsion, "torsion", bearing.torsion);
  if (!axis.is_none()) {
    bearing.axis = vec3(axis, (head + "axis").c_str());
    if (dot(bearing.axis, bearing.axis) == 0)
      throw InputError(head + "axis has zero length; give a nonzero axis");
  }
  set_along_or_all(offset, head + "offset", bearing.offset_along, bearing.offset);
  set_along_or_all(preload, head + "preload", bearing.preload_along, bearing.preload);
  if (!turn.is_none()) bearing.turn = vec3(turn, (head + "turn").c_str());
  std::erase_if(spec.bearings, [&](const BearingSpec& had) { return had.joint == joint; });
  spec.bearings.push_back(bearing);
  return new PyModel(std::move(spec));
}

/// What with_bearing takes of this one.
nb::dict keywords_of(const BearingSpec& bearing) {
  nb::dict out;
  const std::pair<const char*, double> stiffness[] = {{"radial", bearing.radial},
                                                      {"axial", bearing.axial},
                                                      {"tilt", bearing.tilt},
                                                      {"torsion", bearing.torsion}};
  for (const auto& [name, value] : stiffness)
    if (std::isfinite(value)) out[name] = value;
  const std::pair<const char*, Vec3<double>> vectors[] = {{"axis", bearing.axis},
                                                          {"offset", bearing.offset},
                                                          {"turn", bearing.turn},
                                                          {"preload", bearing.preload}};
  for (const auto& [name, v] : vectors)
    if (dot(v, v) > 0) out[name] = nb::make_tuple(v.x, v.y, v.z);
  if (bearing.offset_along != 0) out["offset"] = bearing.offset_along;
  if (bearing.preload_along != 0) out["preload"] = bearing.preload_along;
  return out;
}

}  // namespace

void bind_bearings(ModelClass& c) {
  c.def("with_bearing", &with_bearing, "joint"_a, nb::kw_only(), "radial"_a = nb::none(),
        "axial"_a = nb::none(), "tilt"_a = nb::none(), "torsion"_a = nb::none(),
        "axis"_a = nb::none(), "offset"_a = nb::none(), "turn"_a = nb::none(),
        "preload"_a = nb::none(), nb::rv_policy::take_ownership,
        R"(The same machine with a joint that yields to its load, and so decides loads that rigid
bodies leave open: of all that move the machine alike those of least elastic work.

The limit of stiff bearings: it moves as before, and loads that rigid bodies determine stay. A joint
without a bearing, and a direction without a stiffness, is rigid. Another bearing of a joint
replaces the one it has. A misfit loads what holds the machine more than once, where that yields;
what it moves the machine by is left out.

Args:
    joint: its name; joints that close loops and rods as well.
    radial, axial: stiffness across and along the axis [N/m]; of a rod axial alone.
    tilt, torsion: stiffness against moments across and about the axis [N m/rad].
    axis: (3,) in the frame in which the joint's load is given, of joints without an axis of their
        own.
    offset: where the child stands without load, past where the joint has it [m]: one number along
        the axis, or (3,) in the parent's axes of the joint; of a rod, how much it is too long.
    turn: the same as a turn (3,) [rad].
    preload: the force of the parent on the child that the bearing is mounted with [N], given as
        offset is, of a rod what it pushes with; it is an offset of it over the stiffness, so what a
        joint gets of it is for the stiffnesses of the others to say.

Raises:
    InputError: the joint is unknown, merged, a spring or floating, a stiffness is not above 0 or in
        a direction in which the joint moves freely, a joint without an axis is given none, or a
        preload acts in a direction that has no stiffness.)")
      .def_prop_ro(
          "bearing_joints",
          [](const PyModel& s) {
            nb::list out;
            for (const BearingSpec& bearing : s.model->spec().bearings) out.append(bearing.joint);
            return out;
          },
          "Names of the joints that yield to their loads, as with_bearing made them.")
      .def_prop_ro(
          "bearings",
          [](const PyModel& s) {
            nb::dict out;
            for (const BearingSpec& bearing : s.model->spec().bearings)
              out[bearing.joint.c_str()] = keywords_of(bearing);
            return out;
          },
          "The arguments of with_bearing of each joint that yields to its load, by its name.");
}

}  // namespace linkwise::bindings
