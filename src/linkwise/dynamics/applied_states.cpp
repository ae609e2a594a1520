#include "linkwise/dynamics/applied_states.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <optional>
#include <sstream>
#include <string>

#include "linkwise/base/error.hpp"
#include "linkwise/forces/drive.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise {

void check_states(const Model& m, size_t count, const BatchInput& s) {
  for (int j = 0; s.external && j < m.n_joints(); ++j) {
    if (m.joints[j].last_of_body) continue;
    for (size_t i = 0; i < count; ++i)
      for (int k = 0; k < 6; ++k)
        if (s.external[(i * m.n_joints() + j) * 6 + k] != 0) refuse_wrench(m, j);
  }
  if (!std::isfinite(s.gravity_factor))
    throw InputError("gravity is not finite; give a factor, 1 for the model's gravity, 0 for none");
}

std::vector<double> with_passive_forces(const Model& m, size_t count, const BatchInput& s,
                                        const double* tau) {
  std::vector<double> total(count * m.nv());
  if (tau) std::copy(tau, tau + total.size(), total.begin());
  const std::vector<double> rest(m.nv());
  for (size_t i = 0; i < count; ++i)
    add_passive_forces(m, s.q + i * m.nq(), s.v ? s.v + i * m.nv() : rest.data(),
                       total.data() + i * m.nv());
  return total;
}

void require_directions(const Model& m, const LoopStates& states, const double* tau,
                        const std::string& where) {
  constexpr double meets = 1e-9, noise = 1e-6;
  std::vector<double> force;
  for (int l = 0; l < m.n_loops(); ++l) {
    const LoopJoint& loop = m.loops.joints[l];
    if (loop.kind != LoopKind::spring) continue;
    const double reach = states[l].length;
    if (states.q()[loop.joint.q] + loop.length > meets * reach) continue;
    if (force.empty()) {  // of springs and stops alone: those of dampers vanish at rest
      force.assign(m.loops.nv, 0.0);
      const std::vector<double> rest(m.loops.nv);
      add_passive_forces(m.loops, states.q().data(), rest.data(), force.data());
    }
    const int i = loop.joint.v;
    const auto at = [&](DofProperty p) { return m.loops.dof[static_cast<int>(p)][i]; };
    const double pull = force[i] + (tau ? tau[i] : 0),
                 stiff = at(DofProperty::stiffness) + at(DofProperty::limit_stiffness);
    if (!(std::abs(pull) > noise * stiff * reach)) continue;
    std::ostringstream text;
    text << where << "spring '" << loop.joint.name << "'" << m.where()
         << ": its ends meet, so that its force of " << std::setprecision(3) << std::abs(pull)
         << " N has no direction; take a position beside it, or give it a length of 0";
    throw InputError(text.str());
  }
}

/// What joints that close loops add to a state's input. InputError where it leaves one open.
class AppliedStates::Loops final : public LoopListener {
 public:
  Loops(const Model& model, const BatchInput& s, size_t count, size_t first)
      : model_(model), passive_(s.passive_acts), several_(first + count > 1), first_(first) {}

  void add(size_t i, const double* tau, SweepInput<double>& in, bool later) {
    in.loop_tau = tau;
    row_ = first_ + i;
    if (later) {
      in.on_loops = this;
      return;
    }
    if (!states_) states_.emplace(model_);
    states_->update(in);
    found(*states_, in);
  }

  void found(const LoopStates& loops, SweepInput<double>& in) override {
    const std::string where = several_ ? "state " + std::to_string(row_) + ": " : "";
    require_closed(model_, loops, where);
    require_coupled(model_, loops, in.q, in.v, where);
    if (!passive_) return;
    tau_.assign(model_.loops.nv, 0.0);
    if (in.loop_tau) std::copy_n(in.loop_tau, tau_.size(), tau_.begin());
    require_directions(model_, loops, in.loop_tau, where);
    add_passive_forces(model_.loops, loops.q().data(), loops.v().data(), tau_.data());
    in.loop_tau = tau_.data();
  }

 private:
  const Model& model_;
  std::optional<LoopStates> states_;
  bool passive_, several_;
  size_t first_, row_ = 0;
  std::vector<double> tau_;
};

AppliedStates::AppliedStates(const Model& model, size_t count, const BatchInput& states,
                             size_t first)
    : model_(&model), rows_(states), rest_(states.v ? 0 : model.nv()) {
  check_states(model, count, states);
  if (states.passive_acts && model.has_passive_forces())
    torques_ = with_passive_forces(model, count, states, states.tau);
  else if (!states.tau)
    torques_.assign(count * model.nv(), 0.0);
  if (!torques_.empty()) rows_.tau = torques_.data();
  if (model.is_constrained()) loops_ = std::make_unique<Loops>(model, states, count, first);
}

AppliedStates::~AppliedStates() = default;

SweepInput<double> AppliedStates::row(size_t i, bool loops_later) {
  const BatchInput row = rows_.from(*model_, i);
  SweepInput<double> in;
  in.q = row.q;
  in.v = row.v ? row.v : rest_.data();
  in.tau = row.tau;
  in.external = row.external;
  in.prescribed = row.prescribed;
  in.loop_du = row.loop_prescribed;
  in.gravity_factor = row.gravity_factor;
  if (loops_) loops_->add(i, row.loop_tau, in, loops_later);
  return in;
}

}  // namespace linkwise
