#include "linkwise/dynamics/independent_loops.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/simd/lane_memory.hpp"

namespace linkwise {
namespace {

constexpr int width = UpperRows::width;
using Wide = UpperRows::Wide;

int blocks(int columns) { return (columns + width - 1) / width; }

bool are_consecutive(const std::vector<int>& x) {
  return x.empty() || x.back() - x.front() == static_cast<int>(x.size()) - 1;
}

LW_INLINE void add_lane(Force<double>& to, const Force<Wide>& F, int i) {
  to += Force<double>{{F.lin.x[i], F.lin.y[i], F.lin.z[i]}, {F.ang.x[i], F.ang.y[i], F.ang.z[i]}};
}
LW_INLINE void add_lane(Force<Wide>& to, int j, const Force<double>& F) {
  to.lin.x[j] += F.lin.x;
  to.lin.y[j] += F.lin.y;
  to.lin.z[j] += F.lin.z;
  to.ang.x[j] += F.ang.x;
  to.ang.y[j] += F.ang.y;
  to.ang.z[j] += F.ang.z;
}
LW_INLINE void add_lane(Force<Wide>& to, int j, const Force<Wide>& F, int i) {
  to.lin.x[j] += F.lin.x[i];
  to.lin.y[j] += F.lin.y[i];
  to.lin.z[j] += F.lin.z[i];
  to.ang.x[j] += F.ang.x[i];
  to.ang.y[j] += F.ang.y[i];
  to.ang.z[j] += F.ang.z[i];
}

LW_INLINE double sum(const Wide& x) {
  double total = 0;
  for (int i = 0; i < width; ++i) total += x[i];
  return total;
}

double sum_of_sizes(const Vec3<double>& r) { return std::abs(r.x) + std::abs(r.y) + std::abs(r.z); }

}  // namespace

IndependentLoops::IndependentLoops(const Model& model, const std::vector<LoopGroup>& groups,
                                   const std::vector<std::vector<char>>& taken,
                                   const LoopMetric& metric)
    : model_(model), metric_(metric), dropped_(model.n_loops()) {
  for (size_t g = 0; g < groups.size(); ++g) {
    groups_.push_back(reduced(groups[g], taken[g]));
    work_.push_back(work_of(groups_.back()));
  }
}

/// The group with the rows taken alone. Columns of a carrier begin a block of lanes.
IndependentLoops::Group IndependentLoops::reduced(const LoopGroup& group,
                                                  const std::vector<char>& taken) {
  LoopGroup own;
  own.top = group.top;
  std::vector<std::vector<int>> kept;
  for (const auto& member : group.members) {
    std::vector<int> rows;
    for (int i = 0; i < member.n_rows; ++i)
      (taken[member.row + i] ? rows : dropped_[member.loop]).push_back(i);
    if (rows.empty()) continue;
    const int n = static_cast<int>(rows.size());
    own.members.push_back({member.loop, -1, own.rows, n, {}});
    own.rows += n;
    kept.push_back(std::move(rows));
  }
  add_carriers(model_, own);
  Group out{own.top, own.rows, {}, {}};
  std::vector<int> lane(own.columns);
  int first = 0;
  for (const auto& carrier : own.carriers) {
    const int count = static_cast<int>(carrier.rows.size());
    for (int i = 0; i < count; ++i) lane[carrier.first + i] = first * width + i;
    const bool is_axis = model_.topology[carrier.body].joint_kind != JointKind::general;
    out.carriers.push_back({carrier.body, first, count, is_axis ? 1 : 6, carrier.rows,
                            are_consecutive(carrier.rows), carrier.to, -1});
    first += blocks(count);
  }
  for (auto& carrier : out.carriers) {
    for (int& to : carrier.to)
      if (to >= 0) to = lane[to];
    const int to = carrier.to.front();
    if (to >= 0 && to % width == 0 && are_consecutive(carrier.to)) carrier.aligned = to / width;
  }
  for (size_t m = 0; m < own.members.size(); ++m) {
    const auto& member = own.members[m];
    out.members.push_back({member.loop, member.row, std::move(kept[m]), {}, {}});
    for (int begin = 0; begin < member.n_rows; begin += width)
      out.members[m].blocks.push_back({begin, std::min(width, member.n_rows - begin)});
    for (int end = 0; end < 2; ++end)
      out.members[m].at[end] = member.at[end] >= 0 ? lane[member.at[end]] : member.at[end];
  }
  return out;
}

IndependentLoops::Work IndependentLoops::work_of(const Group& group) const {
  std::vector<int> first(group.rows), last(group.rows);
  for (const Member& member : group.members)
    for (size_t i = 0; i < member.kept.size(); ++i) {
      first[member.row + i] = member.row;
      last[member.row + i] = member.row + static_cast<int>(member.kept.size()) - 1;
    }
  int columns = 0;
  for (const Carrier& carrier : group.carriers) {
    for (const int row : carrier.rows) {
      first[row] = std::min(first[row], carrier.rows.front());
      last[row] = std::max(last[row], carrier.rows.back());
    }
    columns += blocks(carrier.count);
  }
  Work w;
  w.Lambda = UpperRows(first, last);
  w.columns.resize(columns);
  w.Psi.resize(group.rows);
  w.V.resize(group.top >= 0 ? group.rows : 0);
  for (auto* x : {&w.beta, &w.r, &w.f, &w.size}) x->resize(group.rows + width);
  return w;
}

/// Adds unit forces to columns or to the top.
void IndependentLoops::add(int at, int count, const Force<Wide>& F, Work& w) const {
  for (int i = 0; i < count; ++i) {
    if (at >= 0)
      add_lane(w.columns[(at + i) / width].F, (at + i) % width, F, i);
    else
      add_lane(w.Psi[-1 - at + i], F, i);
  }
}

/// The directions of a block of rows, side by side.
void IndependentLoops::set_directions(const LoopState& loop, int l, const Member& member,
                                      Block& block) const {
  block.Q = {};
  for (int i = 0; i < block.count; ++i) {
    const Vector6<double>& q = loop.row[member.kept[block.begin + i]];
    add_lane(block.Q, i, to_force(q.data()));
  }
  block.on_b = transpose_times(model_.loops.joints[l].on_child, block.Q);
  block.yields = dot(metric_.of_child(l) * block.on_b, block.on_b);
}

/// Unit forces where they act, what they ask for, and what the bodies yield to them.
void IndependentLoops::place(const LoopStates& states, Member& member, Work& w) const {
  const int l = member.loop;
  const LoopState& loop = states[l];
  for (Block& block : member.blocks) {
    if (!states.is_element(l) || !block.known) set_directions(loop, l, member, block);
    block.known = true;
    const Force<Wide> reaction = transpose_times(loop.X_FA, block.Q);
    const Force<Wide> on_a{-reaction.lin, -reaction.ang};
    const auto at = [&](int end) {
      return member.at[end] + (member.at[end] >= 0 ? block.begin : -block.begin);
    };
    add(at(0), block.count, on_a, w);
    add(at(1), block.count, block.on_b, w);
    const Wide yields = block.yields + dot(metric_.of_parent(l) * on_a, on_a);
    for (int i = 0; i < block.count; ++i) {
      const int k = member.kept[block.begin + i], row = member.row + block.begin + i;
      w.r[row] = loop.r[k];
      w.size[row] = yields[i] + loop.yields[k];
      w.Lambda.row(row)[row] += loop.yields[k];
    }
  }
}

void IndependentLoops::carry(const TreeSweeps<double>& sweeps, const SweepInput<double>& in,
                             const LoopStates& states, int g) {
  Work& w = work_[g];
  for (const Carrier& carrier : groups_[g].carriers)
    for (int b = 0; b < blocks(carrier.count); ++b) {
      w.columns[carrier.first + b].F = {};
      std::fill_n(w.columns[carrier.first + b].z, carrier.most_z, Wide{});
    }
  std::fill(w.Psi.begin(), w.Psi.end(), Force<double>{});
  std::fill(w.beta.begin(), w.beta.end(), 0.0);
  w.Lambda.clear();
  for (Member& member : groups_[g].members) place(states, member, w);
  for (const Carrier& carrier : groups_[g].carriers) {
    const std::span columns(w.columns.data() + carrier.first,
                            static_cast<size_t>(blocks(carrier.count)));
    const int dof = sweeps.carry_loops(in, carrier.body, columns);
    for (int i = 0; i < carrier.count; ++i)
      w.beta[carrier.rows[i]] += columns[i / width].beta[i % width];
    add_products(carrier, dof, w);
    pass_on(carrier, w);
  }
}

/// Lambda += z^T y.
void IndependentLoops::add_products(const Carrier& carrier, int dof, Work& w) const {
  const Column* const columns = w.columns.data() + carrier.first;
  const int n = blocks(carrier.count), base = carrier.rows.front();
  for (int i = 0; i < carrier.count; ++i) {
    double* const row = w.Lambda.row(carrier.rows[i]);
    for (int b = carrier.in_a_row ? i / width : 0; b < n; ++b) {
      Wide sum = columns[i / width].z[0][i % width] * columns[b].y[0];
      for (int k = 1; k < dof; ++k) sum += columns[i / width].z[k][i % width] * columns[b].y[k];
      if (carrier.in_a_row) {
        double* const to = row + base + b * width;
        store_lanes(to, load_lanes<Wide>(to) + sum);
      } else {
        for (int j = 0; j < width && b * width + j < carrier.count; ++j)
          row[carrier.rows[b * width + j]] += sum[j];
      }
    }
  }
}

void IndependentLoops::pass_on(const Carrier& carrier, Work& w) const {
  const Column* const columns = w.columns.data() + carrier.first;
  if (carrier.aligned >= 0) {
    for (int b = 0; b < blocks(carrier.count); ++b)
      w.columns[carrier.aligned + b].F += columns[b].at_parent;
    return;
  }
  for (int i = 0; i < carrier.count; ++i) {
    const Force<Wide>& F = columns[i / width].at_parent;
    const int to = carrier.to[i];
    if (to >= 0)
      add_lane(w.columns[to / width].F, to % width, F, i % width);
    else
      add_lane(w.Psi[-1 - to], F, i % width);
  }
}

bool IndependentLoops::factor(int g, double least) {
  Work& w = work_[g];
  const int n = groups_[g].rows;
  for (int i = 0; i < n; ++i) w.f[i] = least * w.size[i];
  if (!w.Lambda.factor(w.f.data())) return false;
  double smallest = 1, largest = 0;
  for (int i = 0; i < n; ++i) {
    const double part = w.Lambda.pivot(i) / w.size[i];
    smallest = std::min(smallest, part);
    largest = std::max(largest, part);
  }
  w.smallest = largest > 0 ? smallest / largest : 1;
  return true;
}

Contribution<double> IndependentLoops::reduce_top(int g) {
  Work& w = work_[g];
  const int n = groups_[g].rows;
  for (int i = 0; i < n; ++i) {
    const Force<double>& F = w.Psi[i];
    w.V[i] = {F.lin.x, F.lin.y, F.lin.z, F.ang.x, F.ang.y, F.ang.z, w.r[i] - w.beta[i], 0};
  }
  double sum[7][8] = {};
  for (int k = 0; k < n; ++k) {
    const double* const row = w.Lambda.row(k);
    const auto V = w.V[k];
    std::array<double, 8> part;
    for (int c = 0; c < 8; ++c) part[c] = w.Lambda.inverse(k) * V[c];
    for (int i = k + 1; i <= w.Lambda.last(k); ++i)
      for (int c = 0; c < 8; ++c) w.V[i][c] -= row[i] * part[c];
    for (int a = 0; a < 7; ++a)
      for (int c = 0; c < 8; ++c) sum[a][c] += V[a] * part[c];
  }
  Contribution<double> more{};
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) entry(more.Y, i, j) = sum[i][j];
  more.p -= to_force(sum[6]);
  return more;
}

void IndependentLoops::solve(TreeSweeps<double>& sweeps, int g, const Motion<double>& top) {
  Work& w = work_[g];
  for (int i = 0; i < groups_[g].rows; ++i) w.f[i] = w.r[i] - w.beta[i] - dot(top, w.Psi[i]);
  std::fill_n(w.f.begin() + groups_[g].rows, width, 0.0);
  w.Lambda.solve(w.f.data());
  for (const Carrier& carrier : groups_[g].carriers) {
    const Column* const columns = w.columns.data() + carrier.first;
    const int dof = sweeps.n_columns(carrier.body);
    double z[6] = {}, y[6] = {};
    for (int b = 0; b < blocks(carrier.count); ++b) {
      Wide f{};
      for (int i = 0; i < width && b * width + i < carrier.count; ++i)
        f[i] = w.f[carrier.rows[b * width + i]];
      for (int k = 0; k < dof; ++k) z[k] += sum(Wide(f * columns[b].z[k]));
      for (int k = 0; k < dof && dof == 6; ++k) y[k] += sum(Wide(f * columns[b].y[k]));
    }
    sweeps.apply_loops(carrier.body, z, y);
  }
}

double IndependentLoops::missed(const TreeSweeps<double>& sweeps, const LoopStates& states,
                                const Motion<double>& ground) const {
  double worst = 0;
  for (int l = 0; l < model_.n_loops(); ++l) {
    if (dropped_[l].empty()) continue;
    const LoopJoint& joint = model_.loops.joints[l];
    const LoopState& loop = states[l];
    const Motion<double>& a =
        joint.parent_body >= 0 ? sweeps.acceleration(joint.parent_body) : ground;
    const Motion<double>& b =
        joint.joint.body >= 0 ? sweeps.acceleration(joint.joint.body) : ground;
    const Motion<double> of_a = loop.X_FA * a, of_b = joint.on_child * b;
    const Vector6<double> apart =
        to_array(Motion<double>{of_b.lin - of_a.lin, of_b.ang - of_a.ang});
    const double size = sum_of_sizes(of_a.lin) + sum_of_sizes(of_b.lin) +
                        loop.length * (sum_of_sizes(of_a.ang) + sum_of_sizes(of_b.ang));
    for (const int i : dropped_[l]) {
      const Vector6<double>& row = loop.row[i];
      const double miss = along(row, apart) - loop.r[i];
      const double own = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]) +
                         (std::abs(row[3]) + std::abs(row[4]) + std::abs(row[5])) / loop.length;
      if (miss != 0) worst = std::max(worst, std::abs(miss) / (own * size));
      if (std::isnan(miss)) return miss;
    }
  }
  return worst;
}

}  // namespace linkwise
