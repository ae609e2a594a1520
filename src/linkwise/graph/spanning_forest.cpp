#include "linkwise/graph/spanning_forest.hpp"

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>

namespace linkwise {
namespace {

/// Joints by their parent link, in the order given, as linked lists.
struct Outboard {
  std::vector<int> first, next;

  template <class Keep>
  Outboard(const MachineGraph& graph, Keep&& keep)
      : first(graph.n_links(), -1), next(graph.n_joints(), -1) {
    for (int j = graph.n_joints() - 1; j >= 0; --j) {
      if (!keep(j)) continue;
      int& head = first[graph.joints[j].parent];
      next[j] = head;
      head = j;
    }
  }
};

/// Chooses the joint that each link hangs on. A link is reached when all joints that lead to it
/// were met, so the best of them is known. If links wait for each other, as around a directed
/// cycle, the link met first goes ahead with the joints that have led to it so far.
class Choice {
 public:
  explicit Choice(const MachineGraph& graph)
      : graph_(graph), outboard_(graph, [&](int j) { return !graph.joints[j].closes; }) {
    const int n = graph.n_links();
    inboard.assign(n, -1);
    depth_.assign(n, -1);
    unmet_.assign(n, 0);
    for (const auto& joint : graph.joints) unmet_[joint.child] += !joint.closes;
    std::vector<char> is_child(n);
    for (int link = 0; link < n; ++link) is_child[link] = unmet_[link] > 0;
    grow(graph.ground);
    for (bool of_cycles : {false, true})
      for (int link = 0; link < n; ++link)
        if (depth_[link] < 0 && (of_cycles || !is_child[link])) grow(link);
  }

  std::vector<int> roots, inboard;

 private:
  void grow(int root) {
    roots.push_back(root);
    inboard[root] = -1;
    reach(root, 0);
    for (size_t met = 0;;) {
      int link = -1;
      if (!ready_.empty()) {
        link = ready_.back();
        ready_.pop_back();
      } else if (met < met_.size()) {
        link = met_[met++];
      } else {
        break;
      }
      if (depth_[link] < 0) reach(link, depth_[graph_.joints[inboard[link]].parent] + 1);
    }
    met_.clear();
  }

  void reach(int link, int depth) {
    depth_[link] = depth;
    for (int j = outboard_.first[link]; j >= 0; j = outboard_.next[j]) {
      const int child = graph_.joints[j].child;
      if (depth_[child] >= 0) continue;  // leads back to where the tree has been: a loop joint
      if (inboard[child] < 0) met_.push_back(child);
      if (inboard[child] < 0 || price(j) > price(inboard[child])) inboard[child] = j;
      if (--unmet_[child] == 0) ready_.push_back(child);
    }
  }

  /// What is lost if a joint is left out, the most important first.
  std::tuple<bool, bool, bool, int, int, int> price(int j) const {
    const auto& joint = graph_.joints[j];
    const bool rigid = joint.freedom == 0;
    return {joint.stays, rigid, joint.acts, -joint.freedom, -depth_[joint.parent], -j};
  }

  const MachineGraph& graph_;
  const Outboard outboard_;
  std::vector<int> depth_;  // by link: joints between it and its root, -1: not reached
  std::vector<int> unmet_;  // by link: joints that lead to it and were not met
  std::vector<int> ready_;  // links whose joints were all met
  std::vector<int> met_;    // links in the order in which they were first met
};

}  // namespace

SpanningForest make_spanning_forest(const MachineGraph& graph) {
  Choice choice(graph);
  SpanningForest forest{std::move(choice.roots), std::move(choice.inboard), {}, {}};
  const auto hangs = [&](int j) { return forest.inboard[graph.joints[j].child] == j; };
  const Outboard outboard(graph, hangs);
  std::priority_queue<int, std::vector<int>, std::greater<>> ready;
  const auto open = [&](int link) {
    for (int j = outboard.first[link]; j >= 0; j = outboard.next[j]) ready.push(j);
  };
  forest.order.reserve(graph.n_joints());
  for (int root : forest.roots) open(root);
  while (!ready.empty()) {
    const int j = ready.top();
    ready.pop();
    forest.order.push_back(j);
    open(graph.joints[j].child);
  }
  for (int j = 0; j < graph.n_joints(); ++j)
    if (!hangs(j)) forest.loop_joints.push_back(j);
  return forest;
}

std::vector<int> loop_of(const MachineGraph& graph, const SpanningForest& forest, int loop_joint) {
  const auto path = [&](int link) {  // joints from the link to its root
    std::vector<int> joints;
    for (int j; (j = forest.inboard[link]) >= 0; link = graph.joints[j].parent) joints.push_back(j);
    return joints;
  };
  std::vector<int> down = path(graph.joints[loop_joint].parent),
                   up = path(graph.joints[loop_joint].child);
  while (!down.empty() && !up.empty() && down.back() == up.back()) {
    down.pop_back();
    up.pop_back();
  }
  std::reverse(down.begin(), down.end());
  down.push_back(loop_joint);
  down.insert(down.end(), up.begin(), up.end());
  return down;
}

}  // namespace linkwise
