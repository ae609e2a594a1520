// Loads inside elastic links.
#include <cmath>
#include <cstring>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bind.hpp"
#include "linkwise/dynamics/section_loads.hpp"
#include "report.hpp"
#include "states.hpp"

namespace linkwise::bindings {
namespace {

int body_of(const Model& m, const std::string& link) {
  const int joint = m.links[m.link_index(link)].joint;
  if (joint < 0)
    throw InputError("link '" + link + "'" + m.where() + " is the ground; name an elastic link");
  return m.joints[joint].body;
}

std::vector<BeamSection> sections_of(const Model& m, const std::vector<std::string>& links,
                                     const std::vector<double>& places) {
  if (links.size() != places.size())
    throw InputError("links has " + std::to_string(links.size()) + " names and places " +
                     std::to_string(places.size()) + "; give one place per name");
  std::vector<BeamSection> sections;
  for (size_t i = 0; i < links.size(); ++i) sections.push_back({body_of(m, links[i]), places[i]});
  return sections;
}

/// The section's axes and place in the link's frame; both are given seen from the body's.
void store_matrix(const Transform<double>& section, const Transform<double>& link, double* out) {
  const Mat3<double> R = link.R * transpose(section.R);
  const Vec3<double> r = link.R * (section.r - link.r);
  const double at[] = {r.x, r.y, r.z};
  for (int i = 0; i < 3; ++i) {
    std::copy_n(R.m + 3 * i, 3, out + 4 * i);
    out[4 * i + 3] = at[i];
    out[12 + i] = 0;
  }
  out[15] = 1;
}

nb::object section_loads(const PyModel& self, const std::vector<std::string>& links,
                         const std::vector<double>& places, nb::handle q, nb::handle v,
                         nb::handle acceleration, nb::handle joint_load, double gravity) {
  const Model& m = *self.model;
  const std::vector<BeamSection> sections = sections_of(m, links, places);
  const States s(m, q, v, acceleration, "acceleration", nb::none());
  const Argument load("joint_load", {size(m.n_loads()), 6}, joint_load);
  if (!load.given || load.lead() != s.lead)
    throw InputError(
        "joint_load has other leading axes than q, v and acceleration; give the "
        "joint loads of these states");
  const size_t n = sections.size();
  NewArray out(s.lead, {n, 10});
  without_gil([&](const GoOn& go_on) {
    SectionLoads of(m, sections);
    std::vector<double> loads(6 * n), elastic(4 * n);
    for (size_t i = 0; i < s.count && go_on(); ++i) {
      SweepInput<double> in;
      in.q = s.q.data + i * size(m.nq());
      in.v = s.v.given ? s.v.data + i * size(m.nv()) : nullptr;
      in.gravity_factor = gravity;
      of.evaluate(in, s.tau.data + i * size(m.nv()), load.data + i * size(6 * m.n_loads()),
                  loads.data(), elastic.data());
      for (size_t k = 0; k < n; ++k) {
        double* row = out.data + 10 * (i * n + k);
        std::copy_n(loads.data() + 6 * k, 6, row);
        std::copy_n(elastic.data() + 4 * k, 4, row + 6);
      }
    }
  });
  check_result(out.data, s.count * n * 10);
  return out.array;
}

/// Poses of sections in the frames of their links, and what strains say there.
nb::tuple bent_sections(const PyModel& self, const std::vector<std::string>& links,
                        const std::vector<double>& places, nb::handle q) {
  const Model& m = *self.model;
  const std::vector<BeamSection> sections = sections_of(m, links, places);
  const States s(m, q, nb::none(), nb::none(), "tau", nb::none());
  const size_t n = sections.size();
  NewArray poses(s.lead, {n, 4, 4}), elastic(s.lead, {n, 4});
  without_gil([&](const GoOn& go_on) {
    const BentSections of(m, sections);
    std::vector<Transform<double>> to_link(n), found(n);
    for (size_t k = 0; k < n; ++k) {
      const LinkInfo& link = m.links[m.link_index(links[k])];
      to_link[k] = link.placement * m.joints[link.joint].to_user;
    }
    for (size_t i = 0; i < s.count && go_on(); ++i) {
      of.evaluate(s.q.data + i * size(m.nq()), found.data(), elastic.data + 4 * n * i);
      for (size_t k = 0; k < n; ++k)
        store_matrix(found[k], to_link[k], poses.data + 16 * (n * i + k));
    }
  });
  return nb::make_tuple(poses.array, elastic.array);
}

nb::dict beam_properties(const PyModel& self) {
  nb::dict out;
  for (const LinkSpec& link : self.model->spec().links) {
    if (link.body_kind != BodyKind::beam) continue;
    BeamProperties of;
    std::memcpy(&of, link.parameters.data(), sizeof of);
    nb::dict here;
    const std::pair<const char*, double> values[] = {
        {"length", of.length}, {"mass_per_length", of.mass_per_length},
        {"EA", of.EA},         {"EIy", of.EIy},
        {"EIz", of.EIz},       {"GJ", of.GJ},
        {"area", of.area},     {"width", of.width},
        {"height", of.height}};
    for (const auto& [name, value] : values) here[name] = value;
    here["round"] = of.round != 0;
    out[link.name.c_str()] = here;
  }
  return out;
}

/// Angle between the start and the end of each elastic link, in the order of the links.
nb::object elastic_angles(const PyModel& self, nb::handle q) {
  const Model& m = *self.model;
  const States s(m, q, nb::none(), nb::none(), "tau", nb::none());
  std::vector<std::pair<const ElasticShape*, int>> bent;  // and where its coordinates are in q
  for (size_t l = 0; l < m.links.size(); ++l) {
    if (m.spec().links[l].body_kind == BodyKind::rigid) continue;
    const Element& e = m.elements[m.own_element[m.joints[m.links[l].joint].body]];
    bent.emplace_back(e.shape, e.q);
  }
  NewArray out(s.lead, {bent.size()});
  for (size_t i = 0; i < s.count; ++i)
    for (size_t b = 0; b < bent.size(); ++b) {
      const auto& [shape, first] = bent[b];
      const Vec3<double> theta =
          elastic_port::theta(*shape, s.q.data + i * size(m.nq()) + size(first));
      out.data[i * bent.size() + b] = std::sqrt(dot(theta, theta));
    }
  return out.array;
}

}  // namespace

void bind_sections(nb::module_& m) {
  m.def("elastic_angles", &elastic_angles, "model"_a, "q"_a,
        R"(How far the end of each elastic link is turned against its start.

Args:
    model: the machine.
    q: positions (..., nq) [rad, m].

Returns:
    (..., links) [rad], in the order of Model.beam_lengths.)");
  m.def("bent_sections", &bent_sections, "model"_a, "links"_a, "places"_a, "q"_a,
        R"(Where sections of elastic links are, and what their strains say.

Args:
    model: the machine.
    links: an elastic link per section.
    places: where each section is, from the start of its link [m].
    q: positions (..., nq) [rad, m].

Returns:
    Poses (..., sections, 4, 4): matrices that take points [m] of the bent section, x along the
    beam, y and z across it, to the frame of its link; and loads (..., sections, 4): force along x
    [N], moments about x, y, z [N m] by its stretch, twist and curvature, without damping, signed as
    those of section_loads.

Raises:
    InputError: a link is no elastic one, a place is not on it, or shapes do not fit.)");
  m.def("beam_properties", &beam_properties, "model"_a,
        R"(What each elastic link is made of, by its name; links in a row are alike.

Args:
    model: the machine.

Returns:
    Dictionaries of length [m], mass_per_length [kg/m], EA [N], EIy, EIz, GJ [N m2], area [m2], the
    outer width along y and height along z [m], 0 where not known, and round: whether the outside
    is a circle.)");
  m.def("section_loads", &section_loads, "model"_a, "links"_a, "places"_a, "q"_a, "v"_a,
        "acceleration"_a, "joint_load"_a, nb::kw_only(), "gravity"_a = 1.0,
        R"(Loads at sections of elastic links: what the inboard part puts on the outboard part.

Args:
    model: the machine.
    links: an elastic link per section.
    places: where each section is, from the start of its link [m].
    q: (..., nq) [rad, m]; v: (..., nv) [rad/s, m/s]; acceleration: (..., nv) [rad/s2, m/s2];
        joint_load: (..., n_loads, 6) [N, N m]: states with their accelerations and loads.
    gravity: times the model's.

Returns:
    (..., sections, 10): force x, y, z [N] and moment x, y, z [N m] in the axes of the bent section,
    x along the beam, by equilibrium of the outboard part; then what strains and damping say of the
    force along x and the three moments. Tension is a negative force along x.

Raises:
    InputError: a link is no elastic one, a place is not on it, or leading axes differ.)");
}

}  // namespace linkwise::bindings
