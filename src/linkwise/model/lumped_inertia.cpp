#include "linkwise/model/lumped_inertia.hpp"

#include "linkwise/base/error.hpp"
#include "linkwise/model/validate.hpp"
#include "linkwise/spatial/composite.hpp"

namespace linkwise {
namespace {

Inertia<double> about_origin(const LinkSpec& link) {
  Inertia<double> out{link.mass, link.mass * link.com, link.inertia};
  add_point_mass(out.I, link.mass, link.com);
  return out;
}

/// Inertia about the centre of mass; M.m > 0.
Sym3<double> central(const Inertia<double>& M) {
  Sym3<double> out = M.I;
  add_point_mass(out, -M.m, (1 / M.m) * M.mc);
  return out;
}

/// A clearly negative principal moment is an error, except on a welded link where the sum with what
/// it is welded to is a possible inertia: robots in use carry such antennas and sensors.
void check_inertia(const Machine& machine, int l, bool welded, const Inertia<double>& sum,
                   std::vector<Note>& notes) {
  const LinkSpec& link = machine.spec.links[l];
  double principal[3];
  principal_moments(link.inertia, principal);
  if (!clearly_negative(link.mass, principal)) return;
  if (welded && sum.m > 0) {
    double of_sum[3];
    principal_moments(central(sum), of_sum);
    if (!clearly_negative(sum.m, of_sum)) {
      notes.push_back({NoteLevel::warning, link.name,
                       "inertia has a negative principal moment: no real body has it"});
      return;
    }
  }
  throw InputError("link '" + link.name + "'" + machine.where +
                   ": inertia has a negative principal moment (" + number_text(principal[0]) +
                   " kg m2); give a positive semidefinite inertia about the centre of mass");
}

/// A lump without mass that is a body carries several joints, or a stack of six degrees of freedom.
/// What hangs on a light one is find_undetermined's business. No warning: loads are right, and the
/// method that cannot take it refuses it.
void note_massless(const Machine& machine, const Lumps& lumps, std::vector<Note>& notes) {
  for (int j : lumps.moving) {
    const int l = machine.graph.joints[j].child;
    if (!lumps.massless[l] || lumps.light[l] || lumps.stacked[l]) continue;
    notes.push_back(
        {NoteLevel::info, machine.link_name(l),
         std::string("has no mass and ") +
             (lumps.outboard[l] == 1 ? "joints on both sides with more than 6 degrees of freedom"
                                     : "carries several joints") +
             "; method constraint_force cannot take it, articulated_body can"});
  }
}

}  // namespace

bool is_singular(const Inertia<double>& M) {
  if (!(M.m > 0)) return true;
  double principal[3], whole[3];
  principal_moments(central(M), principal);
  principal_moments(M.I, whole);
  return principal[0] <= 1e-12 * whole[2];
}

LumpedInertia lump_inertia(const Machine& machine, const Lumps& lumps, std::vector<Note>& notes) {
  const ModelSpec& spec = machine.spec;
  LumpedInertia out;
  out.from_lead.assign(lumps.lead.size(), Transform<double>{Mat3<double>::identity(), {}});
  out.inertia.reserve(lumps.lead.size());
  for (const LinkSpec& link : spec.links) {
    out.inertia.push_back(about_origin(link));
    out.moving_mass += link.mass;
  }
  for (int j : lumps.welds) {
    const JointSpec& s = machine.joint(j);
    const int parent = machine.graph.joints[j].parent, child = machine.graph.joints[j].child;
    const int lead = lumps.lead[child];
    out.from_lead[child] =
        Transform<double>{transpose(s.rotation), s.translation} * out.from_lead[parent];
    out.inertia[lead] += transform_to_parent(out.from_lead[child], about_origin(spec.links[child]));
    notes.push_back({NoteLevel::merge, spec.links[child].name,
                     "welded to '" + spec.links[lead].name + "' by fixed joint '" + s.name + "'"});
  }
  if (!spec.floating_base) out.moving_mass -= out.inertia[machine.graph.ground].m;
  for (int l = 0; l < machine.n_links(); ++l)
    check_inertia(machine, l, lumps.lead[l] != l, out.inertia[lumps.lead[l]], notes);
  note_massless(machine, lumps, notes);
  return out;
}

}  // namespace linkwise
