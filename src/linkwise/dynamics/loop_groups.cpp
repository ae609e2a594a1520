#include "linkwise/dynamics/loop_groups.hpp"

#include <algorithm>
#include <map>
#include <numeric>

namespace linkwise {
namespace {

/// Sets of loops that are joined one after the other.
class Sets {
 public:
  explicit Sets(int n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int a, int b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

/// Bodies from `body` inward, as far as `top`, which is none of them.
template <class F>
void walk_inward(const Model& model, int body, int top, F&& f) {
  for (; body != top; body = model.topology[body].parent) f(body);
}

void add_carriers(const Model& model, LoopGroup& group) {
  std::map<int, std::vector<int>, std::greater<>> rows;  // by body, tip to base
  for (const auto& member : group.members) {
    const LoopJoint& loop = model.loops.joints[member.loop];
    std::vector<int> path;
    for (const int end : {loop.parent_body, loop.joint.body})
      walk_inward(model, end, group.top, [&](int body) { path.push_back(body); });
    std::sort(path.begin(), path.end());
    path.erase(std::unique(path.begin(), path.end()), path.end());
    for (const int body : path)
      for (int i = 0; i < member.n_rows; ++i) rows[body].push_back(member.row + i);
  }
  std::map<int, const LoopGroup::Carrier*> known;
  group.carriers.reserve(rows.size());
  for (auto& [body, own] : rows) {
    group.carriers.push_back({body, own, group.columns, {}});
    group.columns += static_cast<int>(own.size());
    known[body] = &group.carriers.back();
  }
  const auto column_of = [&](int body, int row) {
    if (body == group.top) return -1 - row;
    const LoopGroup::Carrier& at = *known[body];
    return at.first + static_cast<int>(std::lower_bound(at.rows.begin(), at.rows.end(), row) -
                                       at.rows.begin());
  };
  for (auto& carrier : group.carriers)
    for (const int row : carrier.rows)
      carrier.to.push_back(column_of(model.topology[carrier.body].parent, row));
  for (auto& member : group.members) {
    member.on_a = column_of(model.loops.joints[member.loop].parent_body, member.row);
    member.on_b = column_of(model.loops.joints[member.loop].joint.body, member.row);
  }
}

}  // namespace

int loop_rows(const Model& model, const LoopJoint& loop) {
  if (loop.rod_length > 0) return 1;
  int rows = 6;
  for (const Element& e : stack_of(model, loop))
    if (!e.prescribed) rows -= e.nv;
  return rows;
}

std::vector<LoopGroup> make_loop_groups(const Model& model) {
  const int n = model.n_loops();
  Sets sets(n);
  std::vector<int> first(model.n_bodies(), -1);  // loop that passes a body
  std::vector<LoopPath> paths;
  for (int l = 0; l < n; ++l) {
    paths.push_back(loop_path(model, model.loops.joints[l]));
    for (const auto* path : {&paths[l].to_a, &paths[l].to_b})
      for (const int body : *path) {
        if (first[body] >= 0) sets.join(first[body], l);
        first[body] = l;
      }
  }
  std::map<int, LoopGroup> by_set;
  for (int l = 0; l < n; ++l) {
    const int rows = loop_rows(model, model.loops.joints[l]);
    if (rows == 0) continue;
    const auto [at, is_new] = by_set.try_emplace(sets.find(l));
    LoopGroup& group = at->second;
    group.top = is_new ? paths[l].meets : std::min(group.top, paths[l].meets);
    group.members.push_back({l, group.rows, rows, 0, 0});
    group.rows += rows;
  }
  std::vector<LoopGroup> groups;
  for (auto& [set, group] : by_set) {
    add_carriers(model, group);
    groups.push_back(std::move(group));
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const auto& a, const auto& b) { return a.top > b.top; });
  return groups;
}

}  // namespace linkwise
