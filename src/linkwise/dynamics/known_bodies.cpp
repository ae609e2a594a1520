// Which methods take which kinds of bodies: the table says it, here it is enforced.
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"

namespace linkwise {

namespace {

bool takes(const DynamicsEntry& method, BodyKind kind) {
  if (kind == BodyKind::rigid) return true;
  return BodyKinds::with_coordinates[static_cast<int>(kind)] ? method.own_coordinates
                                                             : method.any_body;
}

}  // namespace

void require_known_bodies(const Model& model, const DynamicsEntry& method) {
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyKind kind = model.topology[n].body_kind;
    if (takes(method, kind)) continue;
    std::string others;
    for (const DynamicsEntry& entry : dynamics_table())
      if (takes(entry, kind)) others += (others.empty() ? "" : ", ") + std::string(entry.name);
    throw InputError("body '" + model.body_name(n) + "'" + model.where() + " is of kind " +
                     body_kind_name(kind) + ", which method " + std::string(method.name) +
                     " does not take; use one of " + others);
  }
}

}  // namespace linkwise
