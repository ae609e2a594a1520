// Elastic links of a Model and of a ModelBuilder.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "joint_lists.hpp"
#include "linkwise/model/flexible_link.hpp"
#include "vectors.hpp"

namespace linkwise::bindings {
namespace {

double of_section(nb::handle section, const char* name) {
  if (!nb::hasattr(section, name))
    throw InputError(
        "section is " + nb::cast<std::string>(nb::str(nb::repr(section))) +
        "; give a linkwise.Section, as Section.round(0.03) or Section.tube(0.05, 0.002)");
  return real_number(section.attr(name), (std::string("section's ") + name).c_str());
}

FlexibleLink flexible_link(std::string link, nb::handle section, nb::handle E, nb::handle G,
                           nb::handle density, nb::handle damping, nb::handle bodies,
                           nb::handle interior_modes, bool stretches, nb::handle end,
                           nb::handle z) {
  FlexibleLink out;
  out.link = std::move(link);
  out.E = real_number(E, "E");
  out.G = real_number(G, "G");
  out.area = of_section(section, "area");
  out.Iy = of_section(section, "Iy");
  out.Iz = of_section(section, "Iz");
  out.J = of_section(section, "J");
  out.width = of_section(section, "width");
  out.height = of_section(section, "height");
  out.round = nb::cast<std::string>(nb::str(section.attr("shape"))) == "round";
  if (!density.is_none()) out.density = real_number(density, "density");
  out.damping = real_number(damping, "damping");
  out.bodies = whole_number(bodies, "bodies").value_or(1);
  out.interior_modes = whole_number(interior_modes, "interior_modes").value_or(2);
  out.stretches = stretches;
  if (!end.is_none()) out.end = vec3(end, "end");
  if (!z.is_none()) out.z = vec3(z, "z");
  return out;
}

/// What is given of a beam, in the order of the arguments.
struct BeamArguments {
  nb::handle section, E, G, density, damping, bodies, interior_modes;
  bool stretches;
  nb::handle end, z;
};

/// As a body of finite elements, where `body` is one, or as beams.
template <class F>
auto with_given(std::string link, nb::handle body, const BeamArguments& beam, F&& f) {
  if (body.is_none()) {
    for (const auto& [name, given] :
         {std::pair{"section", beam.section}, {"E", beam.E}, {"G", beam.G}})
      if (given.is_none())
        throw InputError("flexible link '" + link + "': " + name +
                         " is missing; give section, E and G of a beam, or body");
    return f(flexible_link(std::move(link), beam.section, beam.E, beam.G, beam.density,
                           beam.damping, beam.bodies, beam.interior_modes, beam.stretches, beam.end,
                           beam.z));
  }
  for (const auto& [name, given] : {std::pair{"section", beam.section},
                                    {"E", beam.E},
                                    {"G", beam.G},
                                    {"density", beam.density},
                                    {"end", beam.end},
                                    {"z", beam.z}})
    if (!given.is_none())
      throw InputError("flexible link '" + link + "': " + name +
                       " is given beside body, which has its own; leave it out");
  if (!nb::hasattr(body, "parameters"))
    throw InputError("flexible link '" + link + "': body is " +
                     nb::cast<std::string>(nb::str(nb::repr(body))) +
                     "; give a linkwise.FlexibleBody");
  return f(ModalLink{std::move(link), nb::cast<std::vector<double>>(body.attr("parameters")())});
}

PyModel* with_flexible(const PyModel& self, std::string link, nb::handle section, nb::handle E,
                       nb::handle G, nb::handle density, nb::handle damping, nb::handle bodies,
                       nb::handle interior_modes, bool stretches, nb::handle end, nb::handle z,
                       nb::handle body) {
  self.model->link_index(link);
  return with_given(std::move(link), body,
                    {section, E, G, density, damping, bodies, interior_modes, stretches, end, z},
                    [&](const auto& flexible) {
                      return new PyModel(with_flexible_link(self.model->spec(), flexible));
                    });
}

void make_flexible(ModelBuilder& self, std::string link, nb::handle section, nb::handle E,
                   nb::handle G, nb::handle density, nb::handle damping, nb::handle bodies,
                   nb::handle interior_modes, bool stretches, nb::handle end, nb::handle z,
                   nb::handle body) {
  with_given(std::move(link), body,
             {section, E, G, density, damping, bodies, interior_modes, stretches, end, z},
             [&](auto flexible) { self.make_flexible(std::move(flexible)); });
}

constexpr const char* arguments = R"(

A beam of Euler and Bernoulli from the link's frame, where its inboard joint is, to its end, which
carries what the link carried: it bends in two planes, twists and stretches. Its second-order
shortening is part of it, so that it gets stiffer when it spins or is pulled. The link's mass is
spread over its length; its inertia becomes that of the beam.

Args:
    link: its name.
    section: a linkwise.Section: area, Iy, Iz, J, about the beam's axes.
    E, G: Young's and the shear modulus [Pa].
    density: [kg/m3]; None: the link's mass over its length.
    damping: ratio of each mode to critical damping, 0: none.
    bodies: beams in a row. More follow larger deflections: one that
        bends by 0.15 rad errs by 1 %, and by the square of that.
    interior_modes: of each plane and beam, 0 to 4, besides two that are exact under loads at its
        end.
    stretches: False leaves out its stretch, whose vibration is the fastest.
    end: (3,) in the link's frame [m], where it ends; None: where its outboard joints are.
    z: (3,) in the link's frame, near the beam's z axis; None: the link's z, or its x for a beam
        along z. The beam's x is along it.
    body: a linkwise.FlexibleBody, of finite elements, in place of a beam and of all of the above.
        Its mass and inertia become the link's. Its inboard handle is at the link's frame; joints
        that the link carries must be at its outboard one.

Raises:
    InputError: the link is unknown or flexible already, its joints are at several points, or not at
        the body's outboard handle, its ends coincide, or a number is wrong.)";

}  // namespace

void bind_flexible(ModelClass& model, nb::class_<ModelBuilder>& builder) {
  model.def("with_flexible", &with_flexible, "link"_a, nb::kw_only(), "section"_a = nb::none(),
            "E"_a = nb::none(), "G"_a = nb::none(), "density"_a = nb::none(), "damping"_a = 0.0,
            "bodies"_a = 1, "interior_modes"_a = 2, "stretches"_a = true, "end"_a = nb::none(),
            "z"_a = nb::none(), "body"_a = nb::none(), nb::rv_policy::take_ownership,
            (std::string("The same machine with an elastic link.") + arguments).c_str());
  model.def_prop_ro(
      "beam_lengths",
      [](const PyModel& self) {
        nb::dict out;
        for (const LinkSpec& link : self.model->spec().links)
          if (link.body_kind == BodyKind::beam) out[link.name.c_str()] = link.parameters[0];
        return out;
      },
      "Length [m] of each elastic link, by its name; links in a row count each for itself.");
  model.def_prop_ro(
      "flexible_links",
      [](const PyModel& self) {
        nb::dict out;
        for (const LinkSpec& link : self.model->spec().links)
          if (link.body_kind != BodyKind::rigid)
            out[link.name.c_str()] = body_kind_name(link.body_kind);
        return out;
      },
      "Elastic links by name: \"beam\", or \"modal\" for a body of finite elements.");
  builder.def(
      "make_flexible", &make_flexible, "link"_a, nb::kw_only(), "section"_a = nb::none(),
      "E"_a = nb::none(), "G"_a = nb::none(), "density"_a = nb::none(), "damping"_a = 0.0,
      "bodies"_a = 1, "interior_modes"_a = 2, "stretches"_a = true, "end"_a = nb::none(),
      "z"_a = nb::none(), "body"_a = nb::none(),
      (std::string("Makes a link elastic, once build has all of its joints.") + arguments).c_str());
}

}  // namespace linkwise::bindings
