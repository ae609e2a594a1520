#include "linkwise/graph/body_tree.hpp"

#include <algorithm>
#include <numeric>

namespace linkwise {
namespace {

/// Stacks what is between masses, from the tips inward, as far as six degrees of freedom go.
void stack(const MachineGraph& graph, Lumps& lumps) {
  lumps.stacked.resize(graph.n_links());
  for (int l = 0; l < graph.n_links(); ++l) lumps.stacked[l] = is_between(lumps, l);
  std::vector<int> freedom(graph.n_links(), 0);  // by lead: of the stack outboard of it
  for (auto j = lumps.moving.rbegin(); j != lumps.moving.rend(); ++j) {
    const auto& joint = graph.joints[*j];
    const int link = joint.child;
    if (freedom[link] + joint.freedom > most_stacked) lumps.stacked[link] = 0;
    freedom[lumps.lead[joint.parent]] = joint.freedom + (lumps.stacked[link] ? freedom[link] : 0);
  }
}

}  // namespace

Lumps make_lumps(const MachineGraph& graph, const SpanningForest& forest) {
  Lumps out;
  out.lead.resize(graph.n_links());
  std::iota(out.lead.begin(), out.lead.end(), 0);
  out.massless = graph.massless;
  out.outboard.assign(graph.n_links(), 0);
  for (int j : forest.order) {
    const auto& joint = graph.joints[j];
    const int lead = out.lead[joint.parent];
    if (joint.weld) {
      out.lead[joint.child] = lead;
      out.massless[lead] = out.massless[lead] && graph.massless[joint.child];
      out.welds.push_back(j);
    } else {
      ++out.outboard[lead];
      out.moving.push_back(j);
    }
  }
  for (int j : forest.loop_joints)
    for (int link : {graph.joints[j].parent, graph.joints[j].child}) ++out.outboard[out.lead[link]];
  out.light = out.massless;
  for (auto j = out.moving.rbegin(); j != out.moving.rend(); ++j)
    if (!out.light[graph.joints[*j].child]) out.light[out.lead[graph.joints[*j].parent]] = 0;
  stack(graph, out);
  return out;
}

BodyTree stack_massless(const MachineGraph& graph, const SpanningForest& forest,
                        const Lumps& lumps) {
  std::vector<int> moving_of(graph.n_links(), -1), body_of(graph.n_links(), -1);  // by lead
  for (size_t i = 0; i < lumps.moving.size(); ++i)
    moving_of[graph.joints[lumps.moving[i]].child] = static_cast<int>(i);
  BodyTree out;
  out.bodies.reserve(lumps.moving.size());
  out.joints.reserve(lumps.moving.size());
  for (int j : lumps.moving) {
    const int link = graph.joints[j].child;
    if (lumps.stacked[link]) continue;
    const int first = static_cast<int>(out.joints.size());
    int parent = link;  // lead of the lump that the stack so far hangs on
    do {
      out.joints.push_back(moving_of[parent]);
      parent = lumps.lead[graph.joints[forest.inboard[parent]].parent];
    } while (lumps.stacked[parent] && moving_of[parent] >= 0);
    std::reverse(out.joints.begin() + first, out.joints.end());
    body_of[link] = static_cast<int>(out.bodies.size());
    out.bodies.push_back({link, body_of[parent], first});
  }
  return out;
}

}  // namespace linkwise
