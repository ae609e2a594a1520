#include "linkwise/simulate/loop_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace linkwise {
namespace {

/// s. Rates are differenced over it: their own errors, and those of the difference, are smaller
/// than what steps leave.
constexpr double moment = 1e-6;

double length(const Vec3<double>& r) { return std::sqrt(dot(r, r)); }

}  // namespace

LoopWatch::LoopWatch(const Setup& setup, LoopForces& forces,
                     std::function<void(double, double*)> to_state)
    : tree_(setup.driven()),
      forces_(forces),
      to_state_(std::move(to_state)),
      nq_(tree_.nq()),
      nv_(tree_.nv()),
      columns_(tree_),
      element_of_(nv_),
      at_(nv_),
      along_(tree_.loops.nv),
      slopes_(tree_.loops.nv),
      kernel_(tree_) {
  for (const Element& e : tree_.elements) std::fill_n(element_of_.begin() + e.v, e.nv, &e);
}

void LoopWatch::update(double t, const double* y) {
  state_.assign(y, y + nq_ + nv_);
  to_state_(t, state_.data());
  forces_.update(t, state_.data(), state_.data() + nq_);
  known_ = false;
  q_.assign(y, y + nq_);
  q_.insert(q_.end(), forces_.q(), forces_.q() + tree_.loops.nq);
  v_.assign(y + nq_, y + nq_ + nv_);
  v_.insert(v_.end(), forces_.v(), forces_.v() + tree_.loops.nv);
  for (const Element& e : tree_.loops.elements) {
    if (info_of(e.kind).turning == 0) continue;
    double* own = v_.data() + nv_;
    const Vec3<double> u =
        transpose_times(element_rotation(e, forces_.q()), linear_part(e, forces_.v()));
    const double parts[3] = {u.x, u.y, u.z};
    std::copy_n(parts, info_of(e.kind).turning, own + e.v);
  }
}

void LoopWatch::accelerate(double t, const double* y, const double* ydot, const double* tau,
                           bool loops_too) {
  tau_.assign(tau, tau + nv_);
  tau_.insert(tau_.end(), forces_.tau(), forces_.tau() + tree_.loops.nv);
  dv_.assign(ydot + nq_, ydot + nq_ + nv_);
  dv_.resize(nv(), 0.0);
  std::vector<double> moved(nq_ + nv_);
  for (const double step : {moment, -moment}) {
    if (!loops_too) break;
    for (int i = 0; i < nq_ + nv_; ++i) moved[i] = y[i] + step * ydot[i];
    update(t + step, moved.data());
    for (int i = nv_; i < nv(); ++i) dv_[i] += v_[i] / (2 * step);
  }
  update(t, y);
}

void LoopWatch::find_slopes() {
  known_ = true;
  SweepInput<double> in;
  in.q = state_.data();
  in.v = state_.data() + nq_;
  columns_.update(in);
  for (int l = 0; l < tree_.n_loops(); ++l)
    for (const Element& e : stack_of(tree_, tree_.loops.joints[l]))
      for (int k = 0; k < e.nv && !e.prescribed; ++k) {
        std::vector<Along>& along = along_[e.v + k];
        std::vector<Slope>& slopes = slopes_[e.v + k];
        along.clear();
        slopes.clear();
        find_along(l, e, k, along);
        for (const Along& part : along) at_[part.dof] = part;
        for (const Along& part : along) {
          const Element& moves = *element_of_[part.dof];
          if (part.dof == moves.v) add_slopes(moves, slopes);
        }
      }
}

/// Of rate k of an element of a loop joint.
void LoopWatch::find_along(int loop, const Element& element, int k, std::vector<Along>& out) const {
  const LoopJoint& joint = tree_.loops.joints[loop];
  const LoopState& state = forces_.states()[loop];
  const auto dual = [&](int i) {
    const int* const end = state.dof + state.basis.n;
    return state.basis.dual[std::find(state.dof, end, element.v + i) - state.dof];
  };
  Vector6<double> own = dual(k);
  if (const int turning = info_of(element.kind).turning; k < turning) {
    const Mat3<double> R = element_rotation(element, forces_.q());
    own = {};
    for (int j = 0; j < turning; ++j) {
      const Vec3<double> of_j =
          R * Vec3<double>{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
      const double share = j == 0 ? of_j.x : j == 1 ? of_j.y : of_j.z;
      for (int i = 0; i < 6; ++i) own[i] += share * dual(j)[i];
    }
  }
  const Force<double> F = to_force(own.data());
  const double turning = state.speed / state.length;
  const double of_turns = 2 * (state.speed * length(F.lin) + turning * length(F.ang));
  const double of_shifts = turning * length(F.lin);
  pass_on(forces_.states().path(loop).to_b, wrench_on_b(joint, F), of_turns, of_shifts, out);
  pass_on(forces_.states().path(loop).to_a, wrench_on_a(state, F), of_turns, of_shifts, out);
}

void LoopWatch::pass_on(const std::vector<int>& path, Force<double> F, double of_turns,
                        double of_shifts, std::vector<Along>& out) const {
  for (size_t i = path.size(); i-- > 0;) {
    const int n = path[i];
    const auto add = [&](int dof, const Motion<double>& P) {
      out.push_back({dof, dot(P, F), length(P.ang) * length(F.ang) + length(P.lin) * length(F.lin),
                     of_turns * length(P.ang) + of_shifts * length(P.lin)});
    };
    for (int k = columns_.first(n); k < columns_.first(n + 1); ++k)
      add(columns_.dof(k), columns_.P(k));
    if (on_port(tree_, tree_.topology[n])) {
      const Element& e = tree_.elements[tree_.topology[n].first_element];
      for_columns(e, state_.data(), [&](int k, const Motion<double>& P) { add(e.v + k, P); });
    }
    F = transpose_times(columns_.state(n).X, F);
  }
}

void LoopWatch::add_slopes(const Element& element, std::vector<Slope>& out) const {
  const ElementKindInfo& kind = info_of(element.kind);
  double lin = 0, ang = 0, turn = 0;
  for (int k = 0; k < element.nv; ++k) {
    const Along& at = at_[element.v + k];
    (k < kind.turning ? lin : ang) = std::hypot(k < kind.turning ? lin : ang, at.z);
    turn = std::max(turn, at.turn);
  }
  for (int k = 0; k < element.nq; ++k) {
    const bool of_quaternion = kind.quaternion >= 0 && k >= kind.quaternion;
    if (k < kind.turning)
      out.push_back({element.q + k, lin, turn});
    else if (of_quaternion)  // half an angle
      out.push_back({element.q + k, 2 * ang, 2 * turn});
    else
      out.push_back({element.q + k, std::abs(at_[element.v + k].z), at_[element.v + k].turn});
  }
  for (int k = 0; k < element.nv; ++k) {
    const double z = kind.quaternion >= 0 ? ang : std::abs(at_[element.v + k].z);
    out.push_back({nq_ + element.v + k, 0, k < kind.turning ? lin : z});
  }
}

bool LoopWatch::moves(int rate, const FreeMotion& free) {
  if (!known_) find_slopes();
  double moved = 0, largest = 0;
  for (const Along& part : along_[rate - nv_]) {
    moved += part.z * free.moved()[part.dof];
    largest += part.size * std::abs(free.moved()[part.dof]);
  }
  return std::abs(moved) > FreeMotion::held * largest;
}

/// By what a force along the rate adds to accelerations.
double LoopWatch::inertia(int rate) {
  if (!known_) find_slopes();
  SweepInput<double> in;
  in.q = state_.data();
  std::vector<double> tau(nv_), without(nv_), with(nv_);
  in.tau = tau.data();
  in.loop_q = forces_.near_q();
  if (!kernel_.evaluate(in, without.data(), nullptr)) return 0;
  for (const Along& part : along_[rate - nv_]) tau[part.dof] = part.z;
  if (!kernel_.evaluate(in, with.data(), nullptr)) return 0;
  double mobility = 0;
  for (const Along& part : along_[rate - nv_])
    mobility += part.z * (with[part.dof] - without[part.dof]);
  return mobility > 0 ? 1 / mobility : 0;
}

}  // namespace linkwise
