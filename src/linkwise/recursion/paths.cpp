#include "linkwise/recursion/paths.hpp"

#include <algorithm>
#include <utility>

namespace linkwise {

Paths::Paths(const Model& model) {
  enum class Zone : char { inboard, paths, outboard };
  const int n_bodies = model.n_bodies();
  std::vector<Zone> zone(n_bodies);
  for (int n = 0; n < n_bodies; ++n) {
    const BodyTopology& at = model.topology[n];
    const bool turns = at.body_kind == BodyKind::rigid &&
                       (at.joint_kind == JointKind::hinge || at.joint_kind == JointKind::revolute);
    const Zone inboard = at.parent < 0 ? Zone::inboard : zone[at.parent];
    zone[n] = inboard == Zone::outboard  ? Zone::outboard
              : turns                    ? Zone::paths
              : inboard == Zone::inboard ? Zone::inboard
                                         : Zone::outboard;
    if (zone[n] != Zone::paths) append_to_ranges(zone[n] == Zone::inboard ? trunk : outer, at, n);
  }
  // If several outboard bodies are equally high, the first one continues the path.
  std::vector<int> height(n_bodies, 0), outboard(n_bodies, -1);
  for (int n = n_bodies - 1; n >= 0; --n) {
    const int parent = model.topology[n].parent;
    if (zone[n] != Zone::paths || parent < 0 || zone[parent] != Zone::paths) continue;
    if (height[n] + 1 >= height[parent]) {
      height[parent] = height[n] + 1;
      outboard[parent] = n;
    }
  }
  std::vector<int> root;
  for (int n = 0; n < n_bodies; ++n) {
    const int parent = model.topology[n].parent;
    if (zone[n] == Zone::paths && (parent < 0 || outboard[parent] != n)) root.push_back(n);
  }
  std::stable_sort(root.begin(), root.end(), [&](int a, int b) { return height[a] < height[b]; });
  for (const int first : root) {
    path.push_back(
        {static_cast<int>(body.size()), height[first] + 1, model.topology[first].parent});
    for (int n = first; n >= 0; n = outboard[n]) body.push_back(n);
    std::reverse(body.begin() + path.back().begin, body.end());
  }
}

int Paths::positions(int lanes) const {
  int sum = 0;
  for (size_t last = path.size(); last > 0; last -= std::min<size_t>(last, lanes))
    sum += path[last - 1].length;
  return sum;
}

bool paths_fill(const Model& model, int lanes) {
  if (!model.own_element.empty()) return false;
  const bool branches = std::any_of(model.topology.begin(), model.topology.end(),
                                    [](const BodyTopology& body) { return body.n_children > 1; });
  const auto at_ground = std::count_if(model.topology.begin(), model.topology.end(),
                                       [](const BodyTopology& body) { return body.parent < 0; });
  if (!branches && at_ground < 2) return false;
  const Paths paths(model);
  return paths.positions(lanes) + 0.75 * static_cast<double>(paths.path.size()) <=
         0.75 * static_cast<double>(paths.body.size());
}

}  // namespace linkwise
