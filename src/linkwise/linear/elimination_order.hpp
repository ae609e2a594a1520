#pragma once
// In which order the nodes of a graph are eliminated so that little fills in.
#include <vector>

#include "linkwise/linear/block_graph.hpp"

namespace linkwise {

/// Nodes that are eliminated together, in one dense matrix of their rows and those of the nodes
/// that they then couple. It is made of hubs and of what earlier fronts leave.
struct Front {
  std::vector<int> pivots, rest;
  std::vector<int> hubs, children;  ///< children: places of fronts in the list, all before this one
};

/// By least degree [amestoy1996]: a node is a member of cliques, at first the hubs that it ends on.
/// Eliminating it joins these to one. The degree of a node is bounded by the sizes of its cliques,
/// each less what it shares with the last one made. Nodes that are left with one clique go with it.
/// The fronts come children first, all that a front takes in standing together before it. Of equal
/// degrees the lower node goes first: the order depends on the graph alone.
std::vector<Front> elimination_order(const BlockGraph& graph);

}  // namespace linkwise
