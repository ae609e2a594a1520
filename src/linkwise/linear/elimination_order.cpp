#include "linkwise/linear/elimination_order.hpp"

#include <algorithm>
#include <queue>
#include <utility>

namespace linkwise {
namespace {

class MinimumDegree {
 public:
  explicit MinimumDegree(const BlockGraph& graph)
      : graph_(graph), of_node_(graph.n()), degree_(graph.n(), -1), seen_(graph.n(), -1) {
    for (int k = 0; k < graph.n_hubs(); ++k) {
      cliques_.push_back({});
      for (int e = graph.hub_begin[k]; e < graph.hub_begin[k + 1]; ++e)
        if (graph.dim(graph.end_node[e]) > 0) join(graph.end_node[e], k);
    }
    for (int i = 0; i < graph.n(); ++i) {
      int degree = 0;
      for (const int k : of_node_[i]) degree += cliques_[k].size - graph.dim(i);
      if (graph.dim(i) > 0) queue(i, degree);
    }
  }

  std::vector<Front> run() {
    while (!queue_.empty()) {
      const auto [degree, node] = queue_.top();
      queue_.pop();
      if (degree_[node] == degree && !of_node_[node].empty()) eliminate(node);
    }
    return std::move(fronts_);
  }

 private:
  struct Clique {
    std::vector<int> nodes;
    int size = 0;             ///< rows of its nodes
    bool is_whole = true;     ///< not yet part of a larger one
    int beside = 0, at = -1;  ///< rows outside of clique `at`
  };

  void join(int node, int clique) {
    of_node_[node].push_back(clique);
    cliques_[clique].nodes.push_back(node);
    cliques_[clique].size += graph_.dim(node);
  }
  void queue(int node, int degree) {
    degree_[node] = degree;
    queue_.emplace(degree, node);
  }
  void take_in(Front& front, int clique) {
    cliques_[clique].is_whole = false;
    std::vector<int>().swap(cliques_[clique].nodes);
    (clique < graph_.n_hubs() ? front.hubs : front.children)
        .push_back(clique < graph_.n_hubs() ? clique : clique - graph_.n_hubs());
  }

  void eliminate(int node) {
    const int made = static_cast<int>(cliques_.size());
    Front front;
    Clique clique;
    seen_[node] = made;
    front.pivots.push_back(node);
    for (const int k : of_node_[node]) {
      for (const int i : cliques_[k].nodes)
        if (std::exchange(seen_[i], made) != made) clique.nodes.push_back(i);
      take_in(front, k);
    }
    of_node_[node].clear();
    for (const int i : clique.nodes) clique.size += graph_.dim(i);
    absorb_covered(clique, made, front);
    std::erase_if(clique.nodes, [&](int i) {
      if (!of_node_[i].empty()) return false;
      front.pivots.push_back(i);
      clique.size -= graph_.dim(i);
      return true;
    });
    for (const int i : clique.nodes) {
      int degree = clique.size - graph_.dim(i);
      for (const int k : of_node_[i]) degree += cliques_[k].beside;
      of_node_[i].push_back(made);
      queue(i, degree);
    }
    front.rest = clique.nodes;
    cliques_.push_back(std::move(clique));
    fronts_.push_back(std::move(front));
  }

  /// Cliques that lie in the new one are part of it; of the others it is counted what lies beside.
  void absorb_covered(const Clique& clique, int made, Front& front) {
    for (const int i : clique.nodes)
      for (const int k : of_node_[i]) {
        Clique& other = cliques_[k];
        if (!other.is_whole) continue;
        if (std::exchange(other.at, made) != made) other.beside = other.size;
        other.beside -= graph_.dim(i);
      }
    for (const int i : clique.nodes) {
      for (const int k : of_node_[i])
        if (cliques_[k].is_whole && cliques_[k].beside == 0) take_in(front, k);
      std::erase_if(of_node_[i], [&](int k) { return !cliques_[k].is_whole; });
    }
  }

  const BlockGraph& graph_;
  std::vector<Clique> cliques_;            ///< hubs, then one per front
  std::vector<std::vector<int>> of_node_;  ///< cliques of a node
  std::vector<int> degree_, seen_;
  std::priority_queue<std::pair<int, int>, std::vector<std::pair<int, int>>, std::greater<>> queue_;
  std::vector<Front> fronts_;
};

}  // namespace

std::vector<Front> elimination_order(const BlockGraph& graph) {
  std::vector<Front> fronts = MinimumDegree(graph).run();
  const int n = static_cast<int>(fronts.size());
  // Children first: number them from the last root on backwards, then turn the list round.
  std::vector<char> is_child(n, 0);
  for (const Front& front : fronts)
    for (const int child : front.children) is_child[child] = 1;
  std::vector<int> order, stack;
  for (int f = 0; f < n; ++f)
    if (!is_child[f]) stack.push_back(f);
  while (!stack.empty()) {
    const int f = stack.back();
    stack.pop_back();
    order.push_back(f);
    stack.insert(stack.end(), fronts[f].children.begin(), fronts[f].children.end());
  }
  std::reverse(order.begin(), order.end());
  std::vector<int> place(n);
  for (int i = 0; i < n; ++i) place[order[i]] = i;
  std::vector<Front> sorted;
  for (const int f : order) {
    for (int& child : fronts[f].children) child = place[child];
    std::sort(fronts[f].children.begin(), fronts[f].children.end());
    sorted.push_back(std::move(fronts[f]));
  }
  return sorted;
}

}  // namespace linkwise
