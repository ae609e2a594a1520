// Which methods take which kinds of bodies: the table says it, here it is enforced.
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"

namespace linkwise {

void require_known_bodies(const Model& model, const DynamicsEntry& method) {
  if (method.any_body) return;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyKind kind = model.topology[n].body_kind;
    if (kind == BodyKind::rigid) continue;
    std::string others;
    for (const DynamicsEntry& entry : dynamics_table())
      if (entry.any_body) others += (others.empty() ? "" : ", ") + std::string(entry.name);
    throw InputError("body '" + model.body_name(n) + "'" + model.where() + " is of kind " +
                     body_kind_name(kind) + ", which method " + std::string(method.name) +
                     " does not take; use one of " + others);
  }
}

}  // namespace linkwise
