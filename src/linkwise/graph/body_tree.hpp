#pragma once
// Which links move as one lump, which joints move them, and how those joints lie between bodies.
//
// Links joined by welds are one lump, named by its lead, the link nearest to the ground. A massless
// lump between two joints is no body: its inboard joint is stacked with its outboard one, and the
// two are one connection of the body that follows (docs/theory/model.md). Where that would have
// more than six degrees of freedom, a massless lump is a body after all.
#include <span>
#include <vector>

#include "linkwise/graph/spanning_forest.hpp"

namespace linkwise {

/// Degrees of freedom that the connection of two bodies can have.
inline constexpr int most_stacked = 6;

struct Lumps {
  std::vector<int> lead;       ///< by link
  std::vector<int> welds;      ///< joints inside lumps, in the forest's order
  std::vector<int> moving;     ///< the forest's other joints, in its order
  std::vector<char> massless;  ///< by lead
  std::vector<char> light;     ///< by lead: massless, and so is all that hangs on it
  std::vector<int> outboard;   ///< by lead: moving joints and ends of loop joints on it
  /// By lead: no body of its own, its inboard joint is part of the next body's connection.
  std::vector<char> stacked;
};

Lumps make_lumps(const MachineGraph& graph, const SpanningForest& forest);

struct BodyTree {
  struct Body {
    int link;         ///< lead of its lump
    int parent;       ///< body, -1: ground
    int first_joint;  ///< in `joints`; the last one ends where the next body's first is
  };
  std::vector<Body> bodies;  ///< parents first
  std::vector<int> joints;   ///< by body, from its parent outward: indices into Lumps::moving
};

/// The joints of a body's connection, from its parent outward: indices into Lumps::moving.
inline std::span<const int> joints_of(const BodyTree& tree, int body) {
  const auto end = body + 1 < static_cast<int>(tree.bodies.size())
                       ? tree.bodies[body + 1].first_joint
                       : static_cast<int>(tree.joints.size());
  return std::span(tree.joints)
      .subspan(tree.bodies[body].first_joint, end - tree.bodies[body].first_joint);
}

/// Bodies in the order of the joints that carry them; each takes the joints of the massless lumps
/// inboard of it.
BodyTree stack_massless(const MachineGraph& graph, const SpanningForest& forest,
                        const Lumps& lumps);

/// Has a lump no mass, and one joint outboard that carries some?
inline bool is_between(const Lumps& lumps, int lead) {
  return lumps.massless[lead] && lumps.outboard[lead] == 1 && !lumps.light[lead];
}

}  // namespace linkwise
