#include "linkwise/dynamics/articulated_loops.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "linkwise/base/error.hpp"
#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise {
namespace {

/// Independent rows answer alone where their pivots are so many times what is weak or zero, and
/// where the others hold to this part of the accelerations.
constexpr double clearly = 10, kept = 1e-11;
/// Longer rows of Lambda are for a factor in blocks.
constexpr int most_width = 256;

/// Part of a list of ranges: bodies [begin, end).
std::vector<KindRange> part_of(const std::vector<KindRange>& all, int begin, int end) {
  std::vector<KindRange> part;
  for (KindRange range : all) {
    range.begin = std::max(range.begin, begin);
    range.end = std::min(range.end, end);
    if (range.begin < range.end) part.push_back(range);
  }
  return part;
}

/// Of each term the column of its joint's P, or -1 where its motion is given. InputError where all
/// are given.
std::vector<int> terms_of(const Model& model, const Coupling& coupling) {
  std::vector<int> columns;
  bool any = false;
  for (const Coupling::Term& term : coupling.terms) {
    if (term.closes) {
      const JointInfo& joint = model.joint_at(term.joint);
      columns.push_back(model.loops.elements[joint.first_element].prescribed ? -1 : 0);
      any |= columns.back() == 0;
      continue;
    }
    const BodyTopology& body = model.topology[term.body];
    int column = 0, found = -1;
    for (int i = 0; i < body.n_elements; ++i) {
      const Element& e = model.elements[body.first_element + i];
      if (e.prescribed) continue;
      if (e.v == term.v) found = column;
      column += e.nv;
    }
    columns.push_back(found);
    any |= found >= 0;
  }
  if (!any)
    throw InputError("coupling '" + coupling.name + "'" + model.where() +
                     " ties joints whose motions are all given; leave one of them free");
  return columns;
}

}  // namespace

ArticulatedLoops::ArticulatedLoops(const Model& model)
    : model_(model),
      sweeps_(model),
      states_(model),
      groups_(make_loop_groups(model)),
      metric_(model),
      torques_(model) {
  for (const Coupling& coupling : model.couplings) terms_.push_back(terms_of(model, coupling));
  work_.resize(groups_.size());
  for (size_t g = 0; g < groups_.size(); ++g) {
    const size_t rows = groups_[g].rows;
    Work& w = work_[g];
    w.columns.resize(groups_[g].columns);
    w.Psi.resize(rows);
    w.own_z.resize(groups_[g].own);
    w.own_y.resize(groups_[g].own);
    systems_.emplace_back(groups_[g]);
    for (auto* x : {&w.beta, &w.r, &w.size, &w.f, &w.rhs}) x->resize(rows);
  }
  int end = model.n_bodies();
  for (int g = 0; g < static_cast<int>(groups_.size());) {
    int last = g;
    while (last < static_cast<int>(groups_.size()) && groups_[last].top == groups_[g].top) ++last;
    const int begin = groups_[g].top + 1;
    stages_.push_back({part_of(model.kind_ranges, begin, end), g, last});
    end = begin;
    g = last;
  }
  const int n_groups = static_cast<int>(groups_.size());
  if (end > 0) stages_.push_back({part_of(model.kind_ranges, 0, end), n_groups, n_groups});
  if (!model.bearings.empty()) make_bearing_shares();
}

bool ArticulatedLoops::respond(const double* q, const double* asked, double null, double* du) {
  at_rest_.assign(model_.nv(), 0.0);
  SweepInput<double> in;
  in.q = q;
  in.tau = at_rest_.data();
  in.gravity_factor = 0;
  asked_ = asked;
  null_ = null;
  const bool sound = evaluate(in, du, nullptr);
  asked_ = nullptr;
  return sound;
}

bool ArticulatedLoops::evaluate(const SweepInput<double>& given, double* du, double* loads) {
  SweepInput<double> in = given;
  took_independent_ = false;
  begin(in, loads != nullptr);
  find_states(in);
  if (in.on_loops) in.on_loops->found(states_, in);
  // A gap makes dependent constraints independent, by pivots of the order of its square: they are
  // zero as well. And it makes what they demand differ.
  const double gap = widest_miss(states_, false), slip = widest_miss(states_, true);
  if (!asked_) null_ = null_pivot(gap);
  report_ = {};
  report_.open = std::max(gap, slip);
  add_known_wrenches(in);
  if (!loads && !asked_) {
    if (!independent_known_) return find_independent(), evaluate(given, du, loads);
    if (independent_) {
      const Answer answer = evaluate_independent(in, du);
      if (answer != Answer::none) return answer == Answer::good;
      begin(in, false);
      add_known_wrenches(in);
    }
  }
  return evaluate_all(in, du, loads);
}

void ArticulatedLoops::begin(const SweepInput<double>& in, bool with_loads) {
  sweeps_.start(with_loads);
  sweeps_.calc_velocities(in, model_.kind_ranges);
  sweeps_.add_external(in);
}

/// By all rows.
bool ArticulatedLoops::evaluate_all(const SweepInput<double>& in, double* du, double* loads) {
  const bool with_loads = loads != nullptr;
  for (const Stage& stage : stages_) {
    sweeps_.eliminate_joints(in, stage.ranges, with_loads);
    if (failed_body() >= 0) return false;
    for (int g = stage.first_group; g < stage.last_group; ++g) {
      carry(in, g);
      factor(in, g, with_loads);
      if (groups_[g].top >= 0) reduce_top(g);
    }
  }
  for (size_t i = stages_.size(); i-- > 0;) {
    for (int g = stages_[i].first_group; g < stages_[i].last_group; ++g)
      solve_forces(in, g, with_loads);
    sweeps_.accelerate_bodies(in, stages_[i].ranges, du, with_loads);
  }
  if (!loads) return true;
  sweeps_.store_loads(in.q, loads);
  store_loop_loads(loads + 6 * model_.n_joints());
  for (int g = 0; g < static_cast<int>(shares_.size()); ++g)
    share_by_bearings(g, in.q, in.misfit_factor, loads);
  return true;
}

/// By independent rows, where these are far from dependent and the others hold as well.
ArticulatedLoops::Answer ArticulatedLoops::evaluate_independent(const SweepInput<double>& in,
                                                                double* du) {
  IndependentLoops& loops = *independent_;
  const Motion<double> ground = ground_acceleration<double>(model_, in.gravity_factor);
  LoopReport found = report_;
  for (const Stage& stage : stages_) {
    sweeps_.eliminate_joints(in, stage.ranges, false);
    if (failed_body() >= 0) return Answer::failed;
    for (int g = stage.first_group; g < stage.last_group; ++g) {
      loops.carry(sweeps_, in, states_, g);
      if (!loops.factor(g, clearly * std::max(weak_pivot, null_))) return Answer::none;
      if (groups_[g].top >= 0) sweeps_.receive(groups_[g].top, loops.reduce_top(g));
      found.rows += groups_[g].rows - groups_[g].rotors;
      found.rank += loops.rows(g) - groups_[g].rotors;
      found.smallest_pivot = std::min(found.smallest_pivot, loops.smallest_pivot(g));
    }
  }
  for (size_t i = stages_.size(); i-- > 0;) {
    for (int g = stages_[i].first_group; g < stages_[i].last_group; ++g)
      loops.solve(sweeps_, g, groups_[g].top >= 0 ? sweeps_.acceleration(groups_[g].top) : ground);
    sweeps_.accelerate_bodies(in, stages_[i].ranges, du, false);
  }
  found.strong = found.rank;
  found.contradiction = loops.missed(sweeps_, states_, ground);
  if (!(found.contradiction < kept)) return Answer::none;
  report_ = found;
  took_independent_ = true;
  return Answer::good;
}

/// Of rows that repeat each other at any position, as those across a plane do, some are enough.
/// Which ones, positions drawn by a fixed rule tell: where most are independent, and furthest from
/// dependent. None are taken where a machine that is closed at its zero position is singular there,
/// because it may be everywhere (Bricard's hinges).
void ArticulatedLoops::find_independent() {
  independent_known_ = true;
  if (!model_.couplings.empty() || groups_.empty()) return;
  for (const LoopSystem& system : systems_)
    if (system.width() > most_width) return;
  for (const LoopGroup& group : groups_)
    if (group.own > 0) return;
  constexpr int samples = 4;
  const std::vector<double> start = model_.initial_configuration(), rest(model_.nv());
  std::vector<double> q, du(model_.nv());
  std::vector<std::vector<char>> taken(groups_.size());
  double best = 0;
  int rank = -1;
  SweepInput<double> in;
  in.tau = rest.data();
  in.gravity_factor = 0;
  std::uint32_t draw = 1;
  for (int sample = 0; sample < samples; ++sample) {
    q = start;
    for (double& x : q) {
      draw = 1664525 * draw + 1013904223;
      x += 6 * (draw / 4294967296.0 - 0.5);
    }
    in.q = q.data();
    if (!evaluate(in, du.data(), nullptr)) return;
    if (report_.rank < rank || (report_.rank == rank && report_.smallest_pivot <= best)) continue;
    rank = report_.rank;
    best = report_.smallest_pivot;
    for (size_t g = 0; g < groups_.size(); ++g) take_rows(static_cast<int>(g), taken[g]);
  }
  auto loops = std::make_unique<IndependentLoops>(model_, groups_, taken, metric_);
  in.q = start.data();
  if (!evaluate(in, du.data(), nullptr)) return;
  if (report_.open < 1e-6) {
    begin(in, false);
    independent_ = std::move(loops);
    if (evaluate_independent(in, du.data()) != Answer::good) independent_.reset();
  } else {
    independent_ = std::move(loops);
  }
}

/// Rows of a group that the last factor found to be independent, and those of rotors.
void ArticulatedLoops::take_rows(int g, std::vector<char>& taken) const {
  taken = systems_[g].independent();
  for (const auto& member : groups_[g].members)
    for (int i = states_[member.loop].held; i < member.n_rows; ++i) taken[member.row + i] = 1;
}

void ArticulatedLoops::find_states(const SweepInput<double>& in) {
  states_.update(
      in, [&](int n) { return sweeps_.pose(n); },
      [&](int n) { return n >= 0 ? sweeps_.velocity(n) : Motion<double>{}; });
}

/// Unit forces where they act: on the bodies that the joint joins, or on the top.
void ArticulatedLoops::place_forces(const SweepInput<double>& in, int g) {
  Work& w = work_[g];
  for (auto& column : w.columns) {
    column.F = {};
    std::fill_n(column.z, 6, 0.0);
  }
  std::fill(w.Psi.begin(), w.Psi.end(), Force<double>{});
  std::fill(w.own_z.begin(), w.own_z.end(), 0.0);
  for (const auto& member : groups_[g].members) {
    if (member.coupling >= 0) {
      place_coupling(in, g, member);
      continue;
    }
    const LoopState& loop = states_[member.loop];
    for (int i = 0; i < member.n_rows; ++i) {
      const Force<double> Q = direction(loop.row[i]);
      const auto add = [&](int at, const Force<double>& wrench) {
        (at >= 0 ? w.columns[at + i].F : w.Psi[-1 - at + i]) += wrench;
      };
      add(member.at[0], wrench_on_a(loop, Q));
      add(member.at[1], wrench_on_b(model_.loops.joints[member.loop], Q));
      w.r[member.row + i] = asked_ ? asked_[6 * member.loop + i] : loop.r[i];
      w.size[member.row + i] = std::abs(w.r[member.row + i]);
    }
  }
}

/// A torque in each joint. The row is the sum of slopes times accelerations, of which those of
/// given motions are known; in a joint that closes a loop it is a wrench on both bodies, and the
/// acceleration is P^+ (that of F less that of E) less P^+ c.
void ArticulatedLoops::place_coupling(const SweepInput<double>& in, int g,
                                      const LoopGroup::Member& member) {
  Work& w = work_[g];
  const Coupling& coupling = model_.couplings[member.coupling];
  const CoupledState at = coupled_state(in.q, in.v, states_);
  double asked = -miss_of(coupling, at).bend, size = std::abs(asked);
  size_t end = 0;
  const auto add = [&](const Force<double>& wrench) {
    const int to = member.at[end++];
    (to >= 0 ? w.columns[to].F : w.Psi[-1 - to]) += wrench;
  };
  for (size_t t = 0; t < coupling.terms.size(); ++t) {
    const Coupling::Term& term = coupling.terms[t];
    const int k = terms_[member.coupling][t];
    const double slope = term.slope(at.position(term));
    double known = 0;
    if (k < 0) {
      const double* given = term.closes ? in.loop_du : in.prescribed;
      known = given ? slope * given[term.v] : 0;
      end += term.closes ? 2 : 1;
    } else if (term.closes) {
      const LoopState& loop = states_[term.joint - model_.n_joints()];
      const Force<double> along = direction(loop.basis.dual[0]);
      const Force<double> pull = slope * along;
      add(wrench_on_a(loop, pull));
      add(wrench_on_b(model_.loops.joints[term.joint - model_.n_joints()], pull));
      known = -slope * loop.bias;
    } else {
      w.columns[member.at[end++]].z[k] += slope;
    }
    asked -= known;
    size += std::abs(known);
  }
  if (asked_) asked = asked_[6 * model_.n_loops() + member.coupling];
  w.r[member.row] = asked;
  w.size[member.row] = asked_ ? std::abs(asked) : size;
}

void ArticulatedLoops::carry(const SweepInput<double>& in, int g) {
  const LoopGroup& group = groups_[g];
  Work& w = work_[g];
  LoopSystem& system = systems_[g];
  place_forces(in, g);
  system.clear();
  std::fill(w.beta.begin(), w.beta.end(), 0.0);
  for (const auto& carrier : group.carriers) {
    const int count = static_cast<int>(carrier.rows.size());
    const std::span columns(w.columns.data() + carrier.first, static_cast<size_t>(count));
    if (carrier.own > 0) carry_own(g, carrier);
    const int dof = sweeps_.carry_loops(in, carrier.body, columns);
    if (carrier.elastic >= 0) push_own(g, carrier);
    w.y.resize(static_cast<size_t>(dof) * count);
    for (int k = 0; k < dof; ++k)
      for (int j = 0; j < count; ++j) w.y[k * count + j] = columns[j].y[k];
    const std::span rows(carrier.rows);
    const bool in_a_row = count > 0 && rows.back() - rows.front() == count - 1;
    for (int i = 0; i < count; ++i) {
      double* const row = system.row(rows[i]);
      for (int k = 0; k < dof; ++k) {
        const double z = columns[i].z[k], *const y = &w.y[k * count];
        if (in_a_row) {
          double* const own = row + rows.front();
          for (int j = 0; j <= i; ++j) own[j] += z * y[j];
        } else {
          for (int j = 0; j <= i; ++j) row[rows[j]] += z * y[j];
        }
      }
      w.beta[carrier.rows[i]] += columns[i].beta;
      w.size[carrier.rows[i]] += std::abs(columns[i].beta);
      const int to = carrier.to[i];
      (to >= 0 ? w.columns[to].F : w.Psi[-1 - to]) += columns[i].at_parent;
    }
  }
  for (const auto& member : group.members)
    for (int i = member.row; member.loop >= 0 && i < member.row + member.n_rows; ++i)
      system.row(i)[i] += states_[member.loop].yields[i - member.row];
}

/// Coordinates of a carrier's own yield before its joint does.
void ArticulatedLoops::carry_own(int g, const LoopGroup::Carrier& carrier) {
  Work& w = work_[g];
  const std::span columns(w.columns.data() + carrier.first, carrier.rows.size());
  const double* const z = w.own_z.data() + carrier.own_first;
  double* const y = w.own_y.data() + carrier.own_first;
  std::vector<double>& beta = w.rhs;
  sweeps_.carry_loops_own(carrier.body, columns, z, y, beta.data());
  for (size_t i = 0; i < carrier.rows.size(); ++i) {
    double* const row = systems_[g].row(carrier.rows[i]);
    for (size_t j = 0; j <= i; ++j) {
      double sum = 0;
      for (int k = 0; k < carrier.own; ++k) sum += z[i * carrier.own + k] * y[j * carrier.own + k];
      row[carrier.rows[j]] += sum;
    }
    w.beta[carrier.rows[i]] += beta[i];
    w.size[carrier.rows[i]] += std::abs(beta[i]);
  }
}

/// What a carrier on a port transmits along its parent's coordinates.
void ArticulatedLoops::push_own(int g, const LoopGroup::Carrier& carrier) {
  Work& w = work_[g];
  const LoopGroup::Carrier& parent = groups_[g].carriers[carrier.elastic];
  double* const z = w.own_z.data() + parent.own_first;
  for (size_t i = 0; i < carrier.rows.size(); ++i)
    sweeps_.push_own(carrier.body, w.columns[carrier.first + i].F,
                     z + static_cast<size_t>(carrier.to[i] - parent.first) * parent.own);
}

/// D, and the factor of Lambda in coordinates in which D is 1.
void ArticulatedLoops::factor(const SweepInput<double>& in, int g, bool with_loads) {
  const LoopGroup& group = groups_[g];
  LoopSystem& system = systems_[g];
  for (size_t m = 0; m < group.members.size(); ++m) {
    const auto& member = group.members[m];
    double* const D = system.metric(m);
    if (member.coupling >= 0) {
      D[0] = yielding_of(in, member);
      continue;
    }
    metric_.calc(member.loop, states_[member.loop], D);
  }
  system.factor(null_, with_loads);
  report_.rows += group.rows - group.rotors;
  report_.rank += system.rank() - group.rotors;
  report_.strong += system.rank_above(weak_pivot) - group.rotors;
  report_.smallest_pivot = std::min(report_.smallest_pivot, system.smallest_pivot());
}

/// What the group leaves on its top.
void ArticulatedLoops::reduce_top(int g) {
  Work& w = work_[g];
  const int n = groups_[g].rows;
  Contribution<double> more{};
  for (int j = 0; j < 6; ++j) {
    for (int i = 0; i < n; ++i) w.rhs[i] = to_array(w.Psi[i])[j];
    systems_[g].solve(w.rhs);
    for (int r = j; r < 6; ++r) {
      double sum = 0;
      for (int i = 0; i < n; ++i) sum += to_array(w.Psi[i])[r] * w.rhs[i];
      entry(more.Y, r, j) = sum;
    }
  }
  for (int i = 0; i < n; ++i) w.rhs[i] = w.r[i] - w.beta[i];
  systems_[g].solve(w.rhs);
  for (int i = 0; i < n; ++i) more.p -= w.rhs[i] * w.Psi[i];
  sweeps_.receive(groups_[g].top, more);
}

/// f from the acceleration of the top, and what it does to the joints on the paths.
void ArticulatedLoops::solve_forces(const SweepInput<double>& in, int g, bool with_loads) {
  const LoopGroup& group = groups_[g];
  Work& w = work_[g];
  const Motion<double> a = group.top >= 0 ? sweeps_.acceleration(group.top)
                                          : ground_acceleration<double>(model_, in.gravity_factor);
  double asked = 0;
  for (size_t m = 0; m < group.members.size(); ++m)
    for (int k = 0; k < group.members[m].n_rows; ++k) {
      const int i = group.members[m].row + k;
      const double at_top = dot(a, w.Psi[i]);
      w.f[i] = w.r[i] - w.beta[i] - at_top;
      asked = std::max(asked, (w.size[i] + std::abs(at_top)) * systems_[g].scale(m, k));
    }
  const double missed = systems_[g].solve(w.f);
  if (asked > 0) report_.contradiction = std::max(report_.contradiction, missed / asked);
  std::vector<double>& own = w.rhs;
  for (const auto& carrier : group.carriers) {
    const size_t count = carrier.rows.size();
    for (size_t i = 0; i < count; ++i) own[i] = w.f[carrier.rows[i]];
    sweeps_.apply_loops(
        carrier.body, std::span<const LoopColumn<double>>(w.columns.data() + carrier.first, count),
        own.data(), with_loads);
    if (carrier.own > 0)
      sweeps_.apply_loops_own(carrier.body, w.own_z.data() + carrier.own_first, own.data(), count);
  }
}

void ArticulatedLoops::add_known_wrenches(const SweepInput<double>& in) {
  torques_.update(in, states_);
  if (!torques_.any()) return;
  for (int l = 0; l < model_.n_loops(); ++l) {
    const LoopState& loop = states_[l];
    const Force<double> w = torques_.wrench(loop);
    const LoopJoint& at = model_.loops.joints[l];
    if (at.parent_body >= 0) sweeps_.add_wrench(at.parent_body, wrench_on_a(loop, w));
    if (at.joint.body >= 0) sweeps_.add_wrench(at.joint.body, wrench_on_b(at, w));
  }
}

/// D of a coupling: what its joints yield to it, each alone.
double ArticulatedLoops::yielding_of(const SweepInput<double>& in,
                                     const LoopGroup::Member& member) const {
  const Coupling& coupling = model_.couplings[member.coupling];
  const CoupledState at = coupled_state(in.q, in.v, states_);
  double sum = 0;
  for (size_t t = 0; t < coupling.terms.size(); ++t) {
    const int k = terms_[member.coupling][t];
    const Coupling::Term& term = coupling.terms[t];
    const double slope = term.slope(at.position(term));
    if (k < 0) continue;
    double yields = 0;
    if (term.closes) {
      const int l = term.joint - model_.n_joints();
      yields = metric_.yields(l, states_[l], direction(states_[l].basis.dual[0]));
    } else {
      yields = sweeps_.yielding(term.body, k);
    }
    sum += slope * slope * yields;
  }
  return sum > 0 ? sum : 1;  // a coupling of powers alone holds nothing at zero
}

/// Wrenches of the joints of a group on their children.
void ArticulatedLoops::add_to_load(int g, const double* f, std::vector<Force<double>>& load) const {
  for (const auto& member : groups_[g].members) {
    if (member.coupling >= 0) add_coupling_to_load(member, f[member.row], load);
    for (int i = 0; member.loop >= 0 && i < member.n_rows; ++i) {
      const Force<double> Q = direction(states_[member.loop].row[i]);
      const double x = f[member.row + i];
      load[member.loop] += x * Q;
    }
  }
}

/// What a coupling puts into joints that close loops.
void ArticulatedLoops::add_coupling_to_load(const LoopGroup::Member& member, double f,
                                            std::vector<Force<double>>& load) const {
  const Coupling& coupling = model_.couplings[member.coupling];
  for (size_t t = 0; t < coupling.terms.size(); ++t) {
    const Coupling::Term& term = coupling.terms[t];
    if (!term.closes || terms_[member.coupling][t] < 0) continue;
    const int l = term.joint - model_.n_joints();
    const Force<double> along = direction(states_[l].basis.dual[0]);
    const double torque = f * term.slope(states_.q()[term.q]);
    load[l] += torque * along;
  }
}

void ArticulatedLoops::coupling_loads(const double* q, std::vector<double>& loads) const {
  std::vector<size_t> first(1);
  for (const Coupling& coupling : model_.couplings)
    first.push_back(first.back() + coupling.terms.size());
  loads.assign(first.back(), 0.0);
  const CoupledState at{q, nullptr, states_.q().data(), nullptr};
  for (size_t g = 0; g < groups_.size(); ++g)
    for (const auto& member : groups_[g].members) {
      if (member.coupling < 0) continue;
      const Coupling& coupling = model_.couplings[member.coupling];
      for (size_t t = 0; t < coupling.terms.size(); ++t)
        loads[first[member.coupling] + t] =
            work_[g].f[member.row] * coupling.terms[t].slope(at.position(coupling.terms[t]));
    }
}

void ArticulatedLoops::store_loop_loads(double* loads) {
  std::vector<Force<double>>& load = load_;
  load.assign(model_.n_loops(), {});
  for (int g = 0; g < static_cast<int>(groups_.size()); ++g)
    add_to_load(g, work_[g].f.data(), load);
  for (int l = 0; l < model_.n_loops(); ++l) {
    load[l] += torques_.wrench(states_[l]);
    store_loop_load(model_.loops.joints[l], load[l], loads + 6 * l);
  }
}

}  // namespace linkwise
