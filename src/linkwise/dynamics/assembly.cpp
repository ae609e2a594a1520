#include "linkwise/dynamics/assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <memory>
#include <set>
#include <sstream>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/loop_work.hpp"
#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise {
namespace {

/// Gaps are closed below the first; above the second, a position is not assembled.
constexpr double closed = 1e-14, assembled = 1e-11;
/// Rates are consistent below this share of a loop's length per second, at a rate of 1.
constexpr double consistent = 1e-9;
constexpr int most_steps = 80, halvings = 10, kicks = 3;
constexpr double longest_turn = 0.5, kick = 1e-3;  // rad, or m
/// Directions that hold less than this are left out, where with all of them no step gets nearer.
constexpr double weakest[] = {1e-12, 1e-7, 1e-4, 1e-2};

std::string rounded(double x) {
  std::ostringstream text;
  text << std::setprecision(3) << x;
  return text.str();
}

class Closing {
 public:
  explicit Closing(const Model& model)
      : model_(model),
        loops_(model, count_loop_work(model).prefers_graph()),
        du_(model.nv()),
        step_(model.nv()) {}

  /// Whether q could be assembled; otherwise it is the best that was found.
  bool close(std::vector<double>& q) {
    double open = newton(q);
    std::uint32_t seed = 1;
    for (int k = 0; k < kicks && open > assembled; ++k) {
      std::vector<double> other = q;
      leave_dead_end(seed, std::pow(10.0, k), other);
      const double now = newton(other);
      if (now < open) {
        open = now;
        q = other;
      }
    }
    return open <= assembled;
  }

  LoopProjection& loops() { return loops_; }

 private:
  /// Returns what is left open.
  double newton(std::vector<double>& q) {
    double open = loops_.gap(q.data());
    for (int k = 0; k < most_steps && open > closed; ++k) {
      const double before = open;
      for (const double null : weakest)
        if (nearer(q, null, &open)) break;
      if (!(open < before)) break;
    }
    return open;
  }

  /// A step that leaves less open.
  bool nearer(std::vector<double>& q, double null, double* open) {
    loops_.gap(q.data());
    if (!loops_.close(q.data(), null, du_.data())) return false;
    double turn = 0;
    for (const double x : du_) turn = std::max(turn, std::abs(x));
    double length = turn > longest_turn ? longest_turn / turn : 1;
    std::vector<double> trial;
    for (int k = 0; k < halvings; ++k, length /= 2) {
      for (size_t i = 0; i < du_.size(); ++i) step_[i] = length * du_[i];
      trial = q;
      move_by(model_, step_.data(), trial.data());
      const double now = loops_.gap(trial.data());
      if (!(now < (1 - 0.1 * length) * *open)) continue;
      *open = now;
      q = trial;
      return true;
    }
    return false;
  }

  /// Moves all joints that are free a little, in directions that are the same in every run. Elastic
  /// bodies keep their shape.
  void leave_dead_end(std::uint32_t& seed, double times, std::vector<double>& q) {
    std::fill(step_.begin(), step_.end(), 0.0);
    for (const Element& e : model_.elements)
      for (int i = 0; i < e.nv && !e.prescribed && !is_of_body(e); ++i) {
        seed = 1664525u * seed + 1013904223u;
        step_[e.v + i] = times * kick * (static_cast<double>(seed) / 2147483648.0 - 1);
      }
    move_by(model_, step_.data(), q.data());
  }

  const Model& model_;
  LoopProjection loops_;
  std::vector<double> du_, step_;
};

double openness(const LoopState& loop, bool of_rates) {
  const LoopMiss miss = miss_of(loop, of_rates ? loop.slip : loop.gap);
  return miss.shift / loop.length + miss.turn;
}

/// The loop that is open the widest.
int widest(const Model& model, const LoopStates& states, bool of_rates) {
  int worst = 0;
  double largest = -1;
  for (int l = 0; l < model.n_loops(); ++l) {
    const double size = openness(states[l], of_rates);
    if (size > largest) {
      largest = size;
      worst = l;
    }
  }
  return worst;
}

struct LoopGroup {
  std::set<int> loops, bodies;
};

/// Loop l and those that share bodies with it, or with one of these; and all these bodies.
LoopGroup loops_beside(const Model& model, const LoopStates& states, int l) {
  LoopGroup out;
  const auto take = [&](int loop) {
    out.loops.insert(loop);
    for (const auto* path : {&states.path(loop).to_a, &states.path(loop).to_b})
      out.bodies.insert(path->begin(), path->end());
  };
  const auto shares = [&](int loop) {
    for (const auto* path : {&states.path(loop).to_a, &states.path(loop).to_b})
      for (const int body : *path)
        if (out.bodies.count(body)) return true;
    return false;
  };
  take(l);
  for (size_t before = 0; before < out.loops.size();) {
    before = out.loops.size();
    for (int k = 0; k < model.n_loops(); ++k)
      if (!out.loops.count(k) && shares(k)) take(k);
  }
  return out;
}

/// Names of the joints of given motion on loop l and on those beside it.
std::vector<std::string> given_in_loop(const Model& model, const LoopStates& states, int l) {
  std::vector<std::string> given;
  const auto add = [&](const JointInfo& joint, const std::vector<Element>& elements) {
    if (joint.n_elements > 0 && elements[joint.first_element].prescribed)
      given.push_back("'" + joint.name + "'");
  };
  const auto group = loops_beside(model, states, l);
  for (const JointInfo& joint : model.joints)
    if (group.bodies.count(joint.body)) add(joint, model.elements);
  for (const int loop : group.loops) add(model.loops.joints[loop].joint, model.loops.elements);
  return given;
}

/// Empty: no motion is given there.
std::string contradiction(const Model& model, const LoopStates& states, int l,
                          const char* what = "motion") {
  const std::vector<std::string> given = given_in_loop(model, states, l);
  if (given.empty()) return "";
  std::string text = what + std::string(given.size() == 1 ? " of " : "s of ");
  for (size_t k = 0; k < given.size(); ++k)
    text += (k == 0 ? "" : k + 1 < given.size() ? ", " : " and ") + given[k];
  return text + (given.size() == 1 ? " contradicts" : " contradict each other through") +
         " the loop that joint '" + model.loops.joints[l].joint.name + "'" + model.where() +
         " closes";
}

/// To so many digits that it closes what it is said to close.
std::string in_full(double x) {
  std::ostringstream text;
  text << std::setprecision(9) << x;
  return text.str();
}

/// What has to be added to a length so that links meet: slightly more, to leave the dead end.
double enough(double missing) { return 1.001 * missing; }

/// What may be left out of a machine to see whether the rest can be assembled: couplings first,
/// then joints that were given as loops.
struct Removable {
  explicit Removable(const ModelSpec& spec, bool loops) {
    for (const CouplingSpec& c : spec.couplings) couplings.push_back(c.name);
    if (!loops) return;
    for (const LoopJointSpec& l : spec.loop_joints)
      if (l.kind != LoopKind::spring) joints.push_back(l.joint.name);
  }
  std::vector<std::string> couplings, joints;
  size_t size() const { return couplings.size() + joints.size(); }
};

ModelSpec without(ModelSpec spec, const std::string& name, bool coupling) {
  if (coupling) {
    std::erase_if(spec.couplings, [&](const CouplingSpec& c) { return c.name == name; });
  } else {
    std::erase_if(spec.loop_joints, [&](const LoopJointSpec& l) { return l.joint.name == name; });
    std::erase_if(spec.bearings, [&](const BearingSpec& b) { return b.joint == name; });
  }
  return spec;
}

bool closes(ModelSpec spec, std::vector<double> q, const LoopMotion& given) {
  const Model model(std::move(spec));
  if (model.n_loops() + model.n_couplings() == 0) return true;
  Closing closing(model);
  closing.loops().give(given);
  return closing.close(q);
}

/// Of the loop that is open the widest: one change of it that was found to close them all, or "".
std::string tried_remedy(const Model& model, const LoopStates& states, int l,
                         const std::vector<double>& q, const LoopMotion& given) {
  const LoopJoint& loop = model.loops.joints[l];
  const LoopState& state = states[l];
  const int at = loop.joint.spec - static_cast<int>(model.spec().joints.size());
  if (at < 0 || at >= static_cast<int>(model.spec().loop_joints.size())) return "";
  ModelSpec spec = model.spec();
  LoopJointSpec& own = spec.loop_joints[at];
  if (loop.kind == LoopKind::rod) {
    own.length += enough(state.gap[0]);
    if (!(own.length > 0) || !closes(spec, q, given)) return "";
    return "give it the length " + in_full(own.length) + " m, which closes it, or ";
  }
  constexpr double rounding = 1e-6;
  const LoopMiss miss = miss_of(state, state.gap);
  if (miss.turn * state.length > rounding * miss.shift) return "";
  Vec3<double> shift;
  for (int i = 0; i < state.held; ++i) {
    const Vector6<double>& Q = state.basis.Q[i];
    shift += state.gap[i] * Vec3<double>{Q[0], Q[1], Q[2]};
  }
  shift = enough(1) * (own.child_rotation * (loop.joint.to_user.R * shift));
  std::string where;
  double* const point = &own.child_translation.x;
  for (int i = 0; i < 3; ++i) {
    const double by = (&shift.x)[i];
    point[i] -= std::abs(by) > rounding * miss.shift ? by : 0;
    where += (i == 0 ? "(" : ", ") + in_full(point[i]);
  }
  if (!closes(spec, q, given)) return "";
  return "place its point at " + where + ") m on '" + own.joint.child + "', which closes it, or ";
}

/// The same of a coupling: "" where another offset is not enough.
std::string tried_offset(const Model& model, size_t coupling, double offset,
                         const std::vector<double>& q, const LoopMotion& given) {
  ModelSpec spec = model.spec();
  spec.couplings[coupling].offset = offset;
  if (!closes(std::move(spec), q, given)) return "";
  return "give it the offset " + in_full(offset) + ", which closes it, or ";
}

/// Couplings and loop joints that contradict each other: with any one of them left out, the others
/// can be kept. "couplings 'c' and 'd'"; empty: no coupling is among them, or there are too many to
/// try.
std::string contradicting_couplings(const Model& model, const LoopMotion& given,
                                    const std::vector<double>& q) {
  constexpr size_t most_tried = 40;
  const bool motions = std::any_of(model.loops.elements.begin(), model.loops.elements.end(),
                                   [](const Element& e) { return e.prescribed; });
  const Removable all(model.spec(), !motions);  // given motions count all loop joints
  if (all.couplings.empty() || all.size() > most_tried) return "";
  ModelSpec rest = model.spec();
  const auto needed = [&](const std::vector<std::string>& names, bool coupling) {
    std::vector<std::string> kept;
    for (const std::string& name : names) try {
        ModelSpec less = without(rest, name, coupling);
        if (closes(less, q, motions ? given : LoopMotion{}))
          kept.push_back("'" + name + "'");
        else
          rest = std::move(less);
      } catch (const InputError&) {  // something else asks for it
      }
    return kept;
  };
  const auto joints = needed(all.joints, false), couplings = needed(all.couplings, true);
  if (couplings.empty()) return "";
  const auto list = [](const char* kind, const std::vector<std::string>& names) {
    std::string text = std::string(kind) + (names.size() > 1 ? "s " : " ");
    for (size_t k = 0; k < names.size(); ++k)
      text += (k == 0 ? "" : k + 1 < names.size() ? ", " : " and ") + names[k];
    return text;
  };
  return list("coupling", couplings) + (joints.empty() ? "" : " and " + list("joint", joints));
}

/// Where no position near q keeps a coupling: which, and what they are in conflict with.
void refuse_couplings(const Model& model, const LoopStates& states, const LoopMotion& given,
                      const std::vector<double>& q) {
  const Coupling* worst = nullptr;
  CouplingMiss largest{};
  for (const Coupling& coupling : model.couplings) {
    const CouplingMiss miss = miss_of(coupling, coupled_state(q.data(), nullptr, states));
    if (is_kept(miss) || std::abs(miss.gap) <= std::abs(largest.gap)) continue;
    worst = &coupling;
    largest = miss;
  }
  std::string who = contradicting_couplings(model, given, q);
  const bool several = who.find("' and ") != std::string::npos;
  if (!worst && !several) return;  // a loop is open that could not be left out
  if (who.empty()) who = "coupling '" + worst->name + "'";
  if (several)
    throw InputError(who + model.where() +
                     " contradict each other: no position near the start keeps them all; change "
                     "factors or offsets, hold fewer joints, or start from another position");
  const auto at = static_cast<size_t>(worst - model.couplings.data());
  throw InputError(who + model.where() +
                   ": no position near the start keeps it; at best its coordinates add up to " +
                   rounded(largest.gap) + " beside its offset; " +
                   tried_offset(model, at, worst->offset + enough(largest.gap), q, given) +
                   "change its factors, hold fewer joints, or start from another position");
}

[[noreturn]] void refuse_position(const Model& model, const LoopStates& states,
                                  const LoopMotion& motion, const std::vector<double>& q) {
  refuse_couplings(model, states, motion, q);
  const int l = widest(model, states, false);
  const LoopJoint& loop = model.loops.joints[l];
  const LoopMiss miss = miss_of(states[l], states[l].gap);
  const auto link = [&](int k) {
    return k >= 0 ? "'" + model.links[k].name + "'" : std::string("the ground");
  };
  const std::string motions = contradiction(model, states, l);
  if (!motions.empty())
    throw InputError(motions + ": at best it is open by " + rounded(1e3 * miss.shift) + " mm and " +
                     rounded(miss.turn) + " rad between " + link(loop.parent_link) + " and " +
                     link(loop.joint.link) +
                     "; drive one of them, hold fewer joints, or start from another position");
  throw InputError("joint '" + loop.joint.name + "'" + model.where() +
                   " cannot close its loop: at best it is open by " + rounded(1e3 * miss.shift) +
                   " mm and " + rounded(miss.turn) + " rad between " + link(loop.parent_link) +
                   " and " + link(loop.joint.link) + "; " +
                   tried_remedy(model, states, l, q, motion) +
                   "change lengths or the places of its joints, hold fewer joints, or start "
                   "from another position");
}

/// The joints whose coordinates differ, with how much.
std::vector<std::string> changes(const Model& model, const std::vector<double>& before,
                                 const std::vector<double>& after) {
  constexpr double worth_telling = 1e-9;
  std::vector<std::string> lines;
  for (const JointInfo& joint : model.joints) {
    double largest = 0;
    for (int k = joint.q; k < joint.q + joint.nq; ++k)
      if (std::abs(after[k] - before[k]) > std::abs(largest)) largest = after[k] - before[k];
    if (std::abs(largest) > worth_telling)
      lines.push_back("'" + joint.name + "' by " + rounded(largest));
  }
  return lines;
}

std::unique_ptr<const Model> holding(const Model& model, const std::vector<std::string>& hold,
                                     size_t n) {
  ModelSpec spec = model.spec();
  for (size_t k = 0; k < n; ++k)
    if (std::find(spec.prescribed.begin(), spec.prescribed.end(), hold[k]) == spec.prescribed.end())
      spec.prescribed.push_back(hold[k]);
  return std::make_unique<const Model>(std::move(spec));
}

/// Takes the least out of v that keeps loops closed; false: no rates nearby do.
bool try_rates(LoopProjection& loops, const std::vector<double>& q, std::vector<double>& v) {
  double fastest = 0;
  for (const double x : v) fastest = std::max(fastest, std::abs(x));
  for (int k = 0; k < 3; ++k) loops.stop(q.data(), weakest[0], v.data());
  return loops.slip(q.data(), v.data()) <= consistent * (1 + fastest);
}

/// Says what contradicts what, of rates that try_rates() found no remedy for.
[[noreturn]] void refuse_rates(const Model& model, LoopProjection& loops,
                               const std::vector<double>& q, const std::vector<double>& v,
                               bool of_loops) {
  require_coupled(model, loops.states(), q.data(), v.data());
  const int l = widest(model, loops.states(), true);
  const LoopMiss miss = miss_of(loops.states()[l], loops.states()[l].slip);
  const std::string given = contradiction(model, loops.states(), l, of_loops ? "rate" : "motion"),
                    by =
                        ", by " + rounded(miss.shift) + " m/s and " + rounded(miss.turn) + " rad/s";
  if (!given.empty())
    throw InputError(given + by +
                     (of_loops ? "; give fewer of them, or start where the machine can move so"
                               : "; drive one of them, or start where the machine can move"));
  throw InputError(
      "joint '" + model.loops.joints[l].joint.name + "'" + model.where() +
      " opens: no rates near those of the start keep its loop closed" + by +
      "; start at rest, or where the machine can move, and check that axes that should "
      "be parallel are so to all digits");
}

void make_consistent(const Model& model, LoopProjection& loops, const std::vector<double>& q,
                     std::vector<double>& v) {
  if (!try_rates(loops, q, v)) refuse_rates(model, loops, q, v, false);
}

/// The machine in which loop joints of these rates have a given motion, and what this is at q.
class WithLoopRates {
 public:
  WithLoopRates(const Model& model, const std::vector<double>& q, const std::vector<double>& v,
                const LoopMotion& given, const std::vector<LoopRate>& rates)
      : spec_(model.spec()) {
    LoopStates states(model);
    SweepInput<double> in;
    in.q = q.data();
    in.v = v.data();
    in.loop_q = given.q;
    in.loop_v = given.v;
    states.update(in);
    q_ = states.q();
    v_ = states.v();
    if (!given.q)  // those of given motion follow the tree
      std::erase_if(spec_.prescribed, [&](const std::string& name) {
        const auto& joints = model.loops.joints;
        return std::any_of(joints.begin(), joints.end(),
                           [&](const LoopJoint& loop) { return loop.joint.name == name; });
      });
    for (const LoopRate& rate : rates) give(model, rate);
  }

  /// From v [nv], the rates that are nearest; false: there are none. Joints of `hold` keep theirs.
  bool find(const std::vector<double>& q, const std::vector<std::string>& hold,
            std::vector<double>& v, bool must = false) const {
    ModelSpec spec = spec_;
    for (const std::string& name : hold)
      if (std::find(spec.prescribed.begin(), spec.prescribed.end(), name) == spec.prescribed.end())
        spec.prescribed.push_back(name);
    const Model model(std::move(spec));
    LoopProjection loops(model, count_loop_work(model).prefers_graph());
    loops.give({q_.data(), v_.data()});
    loops.gap(q.data());
    std::vector<double> found = v;
    const bool done = try_rates(loops, q, found);
    if (!done && must) refuse_rates(model, loops, q, found, true);
    if (done) v = std::move(found);
    return done;
  }

 private:
  void give(const Model& model, const LoopRate& rate) {
    const auto& joints = model.loops.joints;
    const auto at = std::find_if(joints.begin(), joints.end(), [&](const LoopJoint& loop) {
      return loop.joint.name == rate.joint;
    });
    const std::string who = "loop_velocity: '" + rate.joint + "'" + model.where();
    if (at == joints.end() || at->kind != LoopKind::joint)
      throw InputError(who +
                       " is no joint that closes a loop; rates of joints of the tree stand in v0");
    if (rate.v.size() != static_cast<size_t>(at->joint.nv))
      throw InputError(who + " has " + std::to_string(at->joint.nv) + " rates; " +
                       std::to_string(rate.v.size()) + " are given");
    if (std::find(spec_.prescribed.begin(), spec_.prescribed.end(), rate.joint) !=
        spec_.prescribed.end())
      throw InputError(who + " has a given motion, which says its rate; give one of them");
    spec_.prescribed.push_back(rate.joint);
    std::copy(rate.v.begin(), rate.v.end(), v_.begin() + at->joint.v);
  }

  ModelSpec spec_;
  std::vector<double> q_, v_;
};

/// Of those held each keeps its rates that can, the first one first.
void keep_loop_rates(const WithLoopRates& machine, const std::vector<double>& q,
                     const std::vector<std::string>& hold, std::vector<double>& v) {
  if (!hold.empty() && machine.find(q, hold, v)) return;
  std::vector<std::string> kept;
  for (size_t k = 0; k < hold.size() && hold.size() > 1; ++k) {
    kept.push_back(hold[k]);
    std::vector<double> tried = v;
    if (!machine.find(q, kept, tried)) kept.pop_back();
  }
  machine.find(q, kept, v, true);
}

}  // namespace

Assembly assemble(const Model& model, std::vector<double> q, std::vector<double> v,
                  const std::vector<std::string>& hold, const LoopMotion& given,
                  const std::vector<LoopRate>& rates) {
  for (const std::string& name : hold) model.joint_index(name);
  Assembly out;
  out.q = q;
  out.v = v.empty() ? std::vector<double>(model.nv()) : std::move(v);
  if (rates.empty() && model.n_loops() + model.n_couplings() == 0) return out;
  for (size_t n = hold.size();; --n) {
    const std::unique_ptr<const Model> held = n > 0 ? holding(model, hold, n) : nullptr;
    const Model& own = held ? *held : model;
    Closing closing(own);
    closing.loops().give(given);
    out.gap = closing.loops().gap(q.data());
    out.q = q;
    const bool done = closing.close(out.q);
    if (!done && n > 0) continue;
    closing.loops().gap(out.q.data());
    if (!done) refuse_position(own, closing.loops().states(), given, out.q);
    if (rates.empty())
      make_consistent(own, closing.loops(), out.q, out.v);
    else
      keep_loop_rates({model, out.q, out.v, given, rates}, out.q,
                      {hold.begin(), hold.begin() + static_cast<std::ptrdiff_t>(n)}, out.v);
    out.released.assign(hold.begin() + static_cast<std::ptrdiff_t>(n), hold.end());
    out.moved = changes(model, q, out.q);
    return out;
  }
}

std::string changed_rates(const Model& model, const double* asked, const double* got, bool moving) {
  double fastest = 0;
  for (int i = 0; i < model.nv(); ++i) fastest = std::max(fastest, std::abs(asked[i]));
  std::string text;
  for (const JointInfo& joint : model.joints) {
    int most = joint.v;
    double largest = 0;
    for (int i = joint.v; i < joint.v + joint.nv; ++i)
      if (const double change = std::abs(got[i] - asked[i]); change > largest) {
        largest = change;
        most = i;
      }
    if (!(largest > consistent * (1 + fastest)) || (moving && asked[most] == 0)) continue;
    text += (text.empty() ? "'" : ", '") + joint.name + "' is " + rounded(got[most]) +
            " instead of " + rounded(asked[most]);
  }
  return text;
}

/// A little way along rates that open no loop, loops are open by the square of it. Where the
/// machine can move, closing them takes as little; where it cannot, closing them leads back.
bool can_go_on(const Model& model, LoopProjection& loops, const double* q, const double* given) {
  constexpr double way = 1e-5, tangent = 1e-6, back = 0.5;
  constexpr int most = 40;
  std::vector<double> rates(model.nv()), moved(q, q + model.nq());
  for (const Element& e : model.elements)
    for (int i = e.v; i < e.v + e.nv && !e.prescribed; ++i)
      rates[i] = given ? given[i] : std::cos(2.4 * i);
  const auto size = [&] {
    double largest = 0;
    for (const double x : rates) largest = std::max(largest, std::abs(x));
    return largest;
  };
  const double before = size();
  loops.stop(q, weakest[0], rates.data());
  const double largest = size();
  if (!(largest > tangent * before)) return true;  // it stands still, and loops hold it
  for (double& x : rates) x *= way / largest;
  move_by(model, rates.data(), moved.data());
  std::vector<double> at = moved;
  for (int k = 0; k < most && loops.gap(at.data()) > closed; ++k) {
    if (!loops.close(at.data(), weakest[0], rates.data())) return true;  // nothing is known
    move_by(model, rates.data(), at.data());
  }
  double apart = 0, went = 0;
  for (int i = 0; i < model.nq(); ++i) {
    apart += (at[i] - moved[i]) * (at[i] - moved[i]);
    went += (moved[i] - q[i]) * (moved[i] - q[i]);
  }
  return !(apart > back * back * went);
}

std::string contradicting_motions(const Model& model, const LoopStates& states) {
  std::string found;
  double largest = -1;
  for (int l = 0; l < model.n_loops(); ++l) {
    const double size = openness(states[l], false) + openness(states[l], true);
    if (!(size > largest) || given_in_loop(model, states, l).empty()) continue;
    largest = size;
    found = contradiction(model, states, l);
  }
  return found;
}

void require_assembled(const Model& model, const std::vector<double>& q,
                       const std::vector<double>& v, const LoopMotion& given) {
  LoopStates states(model);
  SweepInput<double> in;
  in.q = q.data();
  in.v = v.data();
  in.loop_q = given.q;
  in.loop_v = given.v;
  states.update(in);
  require_closed(model, states);
  require_coupled(model, states, q.data(), v.data());
}

}  // namespace linkwise
