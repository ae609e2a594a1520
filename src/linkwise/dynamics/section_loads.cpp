#include "linkwise/dynamics/section_loads.hpp"

#include <algorithm>

#include "linkwise/base/error.hpp"
#include "linkwise/model/validate.hpp"

namespace linkwise {
namespace {

const Beam* beam_of(const Model& model, int body) {
  return model.topology[body].body_kind == BodyKind::beam ? &BodiesOfKind<Beam>{model}[body]
                                                          : nullptr;
}

/// What a unit of each rate of the coordinates turns a section by.
Vec3<double> turn_of(const BeamModes& of, int k, double x) {
  if (k < of.twist()) return {};
  if (k == of.twist()) return {x / of.of.length, 0, 0};
  const int p = k < of.first(1) ? 0 : 1;
  const double slope = of.shape(p, k - of.first(p), x, 1);
  return p == 0 ? Vec3<double>{0, 0, slope} : Vec3<double>{0, -slope, 0};
}

Vec3<double> turned(const BeamModes& of, double x, const double* rates) {
  Vec3<double> out;
  for (int k = 0; rates && k < of.n; ++k) out += rates[k] * turn_of(of, k, x);
  return out;
}

Vec3<double> centre(const BeamModes& of, const BeamModes::Station& at,
                    const OwnState<double>& own) {
  const double none[most_coordinates] = {};
  return beam::point(of, at, own, none).r;
}

/// The beam that a section is on. Throws InputError where the body is no beam or the section beside
/// it.
const Beam& beam_at(const Model& model, const BeamSection& section) {
  const auto [body, x] = section;
  const Beam* beam = beam_of(model, body);
  if (!beam)
    throw InputError("link '" + model.body_name(body) + "'" + model.where() +
                     " is no elastic beam and has no loads of sections; name one that is");
  const double L = beam->modes->of.length;
  if (!(x >= 0 && x <= L * (1 + 1e-12)))
    throw InputError("section at " + number_text(x) + " m is not on link '" +
                     model.body_name(body) + "'" + model.where() + ", which is " + number_text(L) +
                     " m long; give a place on it");
  return *beam;
}

/// Body's axes along the beam -> those of the section as bent.
Transform<double> section_pose(const BeamModes& of, const BeamModes::Station& at,
                               const OwnState<double>& own) {
  const Vec3<double> theta = turned(of, at.x, own.q);
  return {elastic_port::rotation(theta, TurnSeries<double>(dot(theta, theta))),
          centre(of, at, own)};
}

/// What coordinates say of the force along x and of the moments, each with its share of damping.
void strain_loads(const BeamModes& of, double x, const OwnState<double>& own, double* sum) {
  std::fill(sum, sum + 4, 0.0);
  for (int k = 0; k < of.n; ++k) {
    const double strain = own.q[k] + of.damping[k] / of.stiffness[k] * own.rate(k);
    if (k < of.twist()) {
      sum[0] -= of.of.EA / of.of.length * strain;
    } else if (k == of.twist()) {
      sum[1] -= of.of.GJ / of.of.length * strain;
    } else {
      const int p = k < of.first(1) ? 0 : 1;
      const double bend = of.shape(p, k - of.first(p), x, 2) * strain;
      sum[p == 0 ? 3 : 2] += p == 0 ? -of.of.EIz * bend : of.of.EIy * bend;
    }
  }
}

}  // namespace

SectionLoads::SectionLoads(const Model& model, std::vector<BeamSection> sections)
    : model_(model), dynamics_(model) {
  for (const BeamSection& section : sections) {
    const auto [body, x] = section;
    const Beam& beam = beam_at(model, section);
    const BeamModes& of = *beam.modes;
    const double L = of.of.length;
    Cut cut{&beam, body, -1, of.station(std::min(x, L)), {}};
    for (int j = 0; j < model.n_joints(); ++j) {
      const BodyTopology& carried = model.topology[model.joints[j].body];
      if (carried.parent == body && on_port(model, carried)) cut.joint = j;
    }
    cut.outboard = of.stations_from(std::min(x, L));
    cuts_.push_back(std::move(cut));
  }
}

BentSections::BentSections(const Model& model, const std::vector<BeamSection>& sections)
    : model_(model) {
  for (const BeamSection& section : sections) {
    const Beam& beam = beam_at(model, section);
    const double x = std::min(section.x, beam.modes->of.length);
    cuts_.push_back({&beam, section.body, beam.modes->station(x)});
  }
}

void BentSections::evaluate(const double* q, Transform<double>* poses, double* elastic) const {
  SweepInput<double> in;
  in.q = q;
  for (size_t i = 0; i < cuts_.size(); ++i) {
    const auto& [beam, body, at] = cuts_[i];
    const OwnState<double> own = own_state(model_, in, body);
    poses[i] = section_pose(*beam->modes, at, own) * beam->to_beam;
    strain_loads(*beam->modes, at.x, own, elastic + 4 * i);
  }
}

/// What the outboard part of the beam itself takes, about the start of the beam in its axes.
Force<double> SectionLoads::outboard_load(const Cut& cut, const SweepInput<double>& in,
                                          const double* du) const {
  const BeamModes& of = *cut.beam->modes;
  const OwnState<double> own = own_state(model_, in, cut.body);
  const int first = own_place(model_, cut.body);
  const Motion<double> v = cut.beam->to_beam * dynamics_.states()[cut.body].v;
  const Motion<double> a = cut.beam->to_beam * dynamics_.acceleration(cut.body);
  double rates[most_coordinates];
  for (int k = 0; k < of.n; ++k) rates[k] = own.rate(k);
  const double density[] = {of.of.rotary_y + of.of.rotary_z, of.of.rotary_y, of.of.rotary_z};
  const auto times_rotary = [&](const Vec3<double>& w) {
    return Vec3<double>{density[0] * w.x, density[1] * w.y, density[2] * w.z};
  };
  Force<double> sum;
  for (const BeamModes::Station& at : cut.outboard) {
    const auto here = beam::point(of, at, own, rates);
    const Vec3<double> speed = v.lin + cross(v.ang, here.r) + here.rate;
    Vec3<double> acceleration = a.lin + cross(a.ang, here.r) + cross(v.ang, speed + here.rate);
    acceleration.x += here.bow;
    for (int k = 0; k < of.n; ++k) acceleration.x += here.along[k] * du[first + k];
    for (int i = 0; i < of.in_plane; ++i) {
      acceleration.y += at.shape[0][i] * du[first + of.first(0) + i];
      acceleration.z += at.shape[1][i] * du[first + of.first(1) + i];
    }
    const Vec3<double> f = at.mass * acceleration;
    sum.lin += f;
    sum.ang += cross(here.r, f);
    const double length = at.mass / of.of.mass_per_length;
    sum.ang += length * times_rotary(a.ang + turned(of, at.x, du + first));
    sum.ang += length * cross(v.ang, times_rotary(v.ang + turned(of, at.x, own.v)));
  }
  return sum;
}

void SectionLoads::evaluate(const SweepInput<double>& in, const double* du,
                            const double* joint_loads, double* loads, double* elastic) {
  dynamics_.evaluate(in, du, nullptr, nullptr);
  for (size_t i = 0; i < cuts_.size(); ++i) {
    const Cut& cut = cuts_[i];
    const BeamModes& of = *cut.beam->modes;
    const OwnState<double> own = own_state(model_, in, cut.body);
    Force<double> w = outboard_load(cut, in, du);
    const double* end = joint_loads + 6 * cut.joint;
    w += transpose_times(elastic_pose(of.port, own.q),
                         Force<double>{{end[0], end[1], end[2]}, {end[3], end[4], end[5]}});
    const Transform<double> X = section_pose(of, cut.at, own);
    const auto here = to_array(inverse_transpose_times(X, w));
    std::copy(here.begin(), here.end(), loads + 6 * i);
    double sum[4];
    strain_loads(of, cut.at.x, own, sum);
    if (!of.stretches) sum[0] = here[0];  // it has no strain that would say
    std::copy(sum, sum + 4, elastic + 4 * i);
  }
}

}  // namespace linkwise
