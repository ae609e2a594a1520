#pragma once
// The graph of a machine's constraints: who acts on whom in A f = b (graph_system.hpp).
#include <string>

#include "linkwise/linear/block_graph.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

/// Nodes and hubs: joints of bodies, loop joints, couplings; bodies.
BlockGraph make_constraint_graph(const Model& model);
/// Why GraphSystem refuses a model, one line with its remedy, or "".
std::string refusal_of_graph(const Model& model);

/// On an elastic body's port, without mass: its frame is the port's.
bool is_massless_on_port(const Model& model, int body);
/// Column of P of the joint that a term couples, or -1 where its motion is given.
int column_of(const Model& model, const Coupling::Term& term);
const LoopJoint& loop_of(const Model& model, const Coupling::Term& term);

}  // namespace linkwise
