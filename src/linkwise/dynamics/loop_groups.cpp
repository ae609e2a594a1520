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

const LoopJoint& loop_of(const Model& model, const Coupling::Term& term) {
  return model.loops.joints[term.joint - model.n_joints()];
}

/// Bodies on which the forces of a member act; -1: the ground.
std::vector<int> ends_of(const Model& model, const LoopGroup::Member& member) {
  if (member.loop >= 0) {
    const LoopJoint& loop = model.loops.joints[member.loop];
    return {loop.parent_body, loop.joint.body};
  }
  std::vector<int> ends;
  for (const Coupling::Term& term : model.couplings[member.coupling].terms) {
    if (term.closes) ends.push_back(loop_of(model, term).parent_body);
    ends.push_back(term.body);
  }
  return ends;
}

/// Coordinates of a body's own that carry a port.
int count_own(const Model& model, int body) {
  if (model.own_element.empty() || model.own_element[body] < 0) return 0;
  const Element& first = model.elements[model.own_element[body]];
  return first.kind == ElementKind::elastic ? first.nv : 0;
}

/// The innermost body that a member's paths start from. A coupling acts within joints of the tree,
/// so its paths start inboard of them.
int top_of(const Model& model, const LoopGroup::Member& member) {
  std::vector<int> ends = ends_of(model, member);
  if (member.coupling >= 0) {
    size_t at = 0;
    for (const Coupling::Term& term : model.couplings[member.coupling].terms) {
      if (!term.closes) ends[at] = model.topology[ends[at]].parent;
      at += term.closes ? 2 : 1;
    }
  }
  int top = ends[0];
  for (int other : ends)
    while (top != other) {  // the one with the higher number is no ancestor of the other
      int& outer = top > other ? top : other;
      outer = model.topology[outer].parent;
    }
  // Forces on a port act along the coordinates that carry it, too: they pass such a body.
  while (top >= 0 && count_own(model, top) > 0) top = model.topology[top].parent;
  return top;
}

/// All loop joints that hold anything, and couplings; where in their group is not known yet.
std::vector<LoopGroup::Member> all_members(const Model& model) {
  std::vector<LoopGroup::Member> members;
  for (int l = 0; l < model.n_loops(); ++l)
    if (const int rows = loop_rows(model, model.loops.joints[l]); rows > 0)
      members.push_back({l, -1, 0, rows, {}});
  for (int c = 0; c < model.n_couplings(); ++c) members.push_back({-1, c, 0, 1, {}});
  return members;
}

}  // namespace

std::vector<int> bodies_of(const Model& model, const LoopGroup::Member& member, int top) {
  std::vector<int> bodies;
  for (const int end : ends_of(model, member))
    walk_inward(model, end, top, [&](int body) { bodies.push_back(body); });
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

void add_carriers(const Model& model, LoopGroup& group) {
  std::map<int, std::vector<int>, std::greater<>> rows;  // by body, tip to base
  for (const auto& member : group.members)
    for (const int body : bodies_of(model, member, group.top))
      for (int i = 0; i < member.n_rows; ++i) rows[body].push_back(member.row + i);
  std::map<int, const LoopGroup::Carrier*> known;
  group.carriers.reserve(rows.size());
  for (auto& [body, own] : rows) {
    group.carriers.push_back({body, own, group.columns, {}});
    group.columns += static_cast<int>(own.size());
    known[body] = &group.carriers.back();
  }
  for (size_t i = 0; i < group.carriers.size(); ++i) {
    LoopGroup::Carrier& at = group.carriers[i];
    at.own = count_own(model, at.body);
    at.own_first = group.own;
    group.own += at.own * static_cast<int>(at.rows.size());
    if (on_port(model, model.topology[at.body]))
      for (size_t k = i + 1; at.elastic < 0; ++k)
        if (group.carriers[k].body == model.topology[at.body].parent)
          at.elastic = static_cast<int>(k);
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
  for (auto& member : group.members)
    for (const int end : ends_of(model, member)) member.at.push_back(column_of(end, member.row));
}

std::vector<LoopGroup> outline_loop_groups(const Model& model) {
  std::vector<LoopGroup::Member> members = all_members(model);
  Sets sets(static_cast<int>(members.size()));
  std::vector<int> first(model.n_bodies(), -1);  // member that passes a body
  std::vector<int> tops;
  for (int i = 0; i < static_cast<int>(members.size()); ++i) {
    tops.push_back(top_of(model, members[i]));
    for (const int body : bodies_of(model, members[i], tops[i])) {
      if (first[body] >= 0) sets.join(first[body], i);
      first[body] = i;
    }
  }
  std::map<int, LoopGroup> by_set;
  for (int i = 0; i < static_cast<int>(members.size()); ++i) {
    const auto [at, is_new] = by_set.try_emplace(sets.find(i));
    LoopGroup& group = at->second;
    group.top = is_new ? tops[i] : std::min(group.top, tops[i]);
    members[i].row = group.rows;
    group.rows += members[i].n_rows;
    if (members[i].loop >= 0)
      group.rotors += loop_rotors(model, model.loops.joints[members[i].loop]);
    group.members.push_back(std::move(members[i]));
  }
  std::vector<LoopGroup> groups;
  for (auto& [set, group] : by_set) groups.push_back(std::move(group));
  std::stable_sort(groups.begin(), groups.end(),
                   [](const auto& a, const auto& b) { return a.top > b.top; });
  return groups;
}

std::vector<LoopGroup> make_loop_groups(const Model& model) {
  std::vector<LoopGroup> groups = outline_loop_groups(model);
  for (LoopGroup& group : groups) add_carriers(model, group);
  return groups;
}

}  // namespace linkwise
