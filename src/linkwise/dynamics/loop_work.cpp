#include "linkwise/dynamics/loop_work.hpp"

#include <algorithm>
#include <limits>

#include "linkwise/constraint/constraint_graph.hpp"
#include "linkwise/dynamics/loop_groups.hpp"
#include "linkwise/solve/direct/graph_factor.hpp"

namespace linkwise {
namespace {

/// Of the sweeps, per body; of a unit force carried through a joint; of a block of A and of the
/// passes of a solution through its row.
constexpr double per_body = 500, per_column = 100, per_node = 2000;
/// Less is below a millisecond by any way.
constexpr double worth_counting = 1e6;

double factor_work(const std::vector<int>& first) {
  double work = 0;
  for (size_t i = 0; i < first.size(); ++i) {
    const double width = static_cast<double>(i) - first[i] + 1;
    work += width * width / 2;
  }
  return work;
}

/// As ArticulatedLoops and LoopSystem do it.
double recursion_work(const Model& model) {
  constexpr int small = 64;  // rows of a group that is factored densely
  std::vector<int> rows(model.n_bodies()), first_row(model.n_bodies(), -1);
  double work = per_body * model.n_bodies();
  for (const LoopGroup& group : outline_loop_groups(model)) {
    std::vector<int> first(group.rows);
    for (const LoopGroup::Member& member : group.members) {
      int begin = member.row;
      for (const int body : bodies_of(model, member, group.top)) {
        if (first_row[body] < 0) first_row[body] = member.row;
        begin = std::min(begin, first_row[body]);
        const double before = rows[body], own = member.n_rows;
        rows[body] += member.n_rows;
        work += own * per_column + own * (before + own) * model.topology[body].nv;
      }
      std::fill_n(first.begin() + member.row, member.n_rows, begin);
    }
    const double n = group.rows;
    work += n <= small ? n * n * n / 6 : factor_work(first);
  }
  return work;
}

/// The joints of one body are all coupled, so the factor takes at least that of the largest body.
double least_graph_work(const BlockGraph& graph) {
  double most = 0;
  for (int k = 0; k < graph.n_hubs(); ++k) {
    double rows = 0;
    for (int e = graph.hub_begin[k]; e < graph.hub_begin[k + 1]; ++e)
      rows += graph.dim(graph.end_node[e]);
    most = std::max(most, rows * rows * rows / 6);
  }
  return most;
}

/// Or less than that where it is `too_much` in any case.
double graph_work(const Model& model, double too_much) {
  if (!refusal_of_graph(model).empty()) return std::numeric_limits<double>::infinity();
  const BlockGraph graph = make_constraint_graph(model);
  if (const double least = least_graph_work(graph); least > too_much) return least;
  return work_of(graph, elimination_order(graph)) + per_node * graph.n();
}

}  // namespace

LoopWork count_loop_work(const Model& model) {
  LoopWork work;
  work.recursion = recursion_work(model);
  work.graph = work.recursion > worth_counting ? graph_work(model, work.recursion)
                                               : std::numeric_limits<double>::infinity();
  return work;
}

}  // namespace linkwise
