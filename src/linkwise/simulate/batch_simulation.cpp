#include "linkwise/simulate/batch_simulation.hpp"

#include <cmath>
#include <limits>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/exec/thread_pool.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {
namespace {

// Beyond this an acceleration is as good as infinite; below, no sum of a step can overflow.
constexpr double largest_acceleration = 1e100;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

size_t load_width(const Model& model) { return 6 * static_cast<size_t>(model.n_joints()); }

/// What the groups of one simulation share.
struct Shared {
  explicit Shared(const Simulation& simulation)
      : model(simulation.model()),
        drives(simulation.drives()),
        wrenches(simulation.wrenches()),
        integrator(simulation.options().integrator),
        options(simulation.options().integration),
        driven_owner(driven_model(model, drives)),
        driven(driven_owner ? *driven_owner : model) {
    for (const Drive& d : drives) any_motion |= d.kind == DriveKind::motion;
    for (const Wrench& w : wrenches) world_wrenches |= w.world;
  }
  const Model& model;
  const std::vector<Drive>& drives;
  const std::vector<Wrench>& wrenches;
  const IntegratorKind integrator;
  const IntegratorOptions& options;
  const std::unique_ptr<const Model> driven_owner;
  const Model& driven;
  bool any_motion = false, world_wrenches = false;
};

/// Up to native_lanes members as one system y = [q of all; v of all].
class Group final : private OdeSystem {
 public:
  Group(const Shared& shared, size_t members, const BatchStart& start)
      : s_(shared),
        n_(members),
        batch_(shared.driven),
        ends_(members),
        alive_(members, true),
        constant_(start.tau),
        tau_(n_ * nv()),
        drive_(n_ * nv()),
        a_(shared.driven_owner ? n_ * nv() : 0),
        external_(shared.wrenches.empty() ? 0 : n_ * n_load()),
        poses_(shared.world_wrenches ? 16 * static_cast<size_t>(shared.model.n_joints()) : 0) {
    y_.assign(start.q, start.q + n_ * nq());
    y_.insert(y_.end(), start.v, start.v + n_ * nv());
    impose(0, y_.data());
    integrator_ = make_integrator(shared.integrator, *this, shared.options);
    integrator_->start(0, y_);
  }

  /// Steps to every time and writes the samples there; `out` belongs to the first member.
  void run(std::span<const double> times, const Sample& out, const std::function<bool()>& go_on) {
    for (size_t k = 0; k < times.size(); ++k) {
      if (reach(times[k], go_on)) integrator_->interpolate(times[k], y_);
      impose(times[k], y_.data());
      write(times[k], k, times.size(), out);
    }
  }

  const std::vector<Ending>& ends() const { return ends_; }

 private:
  size_t nq() const { return s_.model.nq(); }
  size_t nv() const { return s_.model.nv(); }
  size_t n_load() const { return load_width(s_.model); }
  int size() const override { return static_cast<int>(n_ * (nq() + nv())); }
  int position_size() const override { return static_cast<int>(n_ * nq()); }

  bool reach(double t, const std::function<bool()>& go_on) {
    while (integrator_->time() < t) {
      if (!any_alive()) return false;
      if (!go_on()) return end_all(Outcome::interrupted);
      const Outcome outcome = integrator_->step(t);
      if (outcome != Outcome::converged && any_alive()) return end_all(outcome);
    }
    return any_alive();
  }

  bool any_alive() const {
    for (const bool alive : alive_)
      if (alive) return true;
    return false;
  }
  void end(size_t i, Outcome outcome) {
    if (alive_[i])
      ends_[i] = {outcome, integrator_ ? integrator_->time() : 0, -1, describe(outcome)};
    alive_[i] = false;
  }
  bool end_all(Outcome outcome) {
    for (size_t i = 0; i < n_; ++i) end(i, outcome);
    return false;
  }

  Outcome evaluate(double t, const double* y, double* ydot) override {
    if (s_.any_motion || !all_alive()) {
      rows_.assign(y, y + size());
      stand_in(rows_.data());
      impose(t, rows_.data());
      y = rows_.data();
    }
    double* dv = ydot + n_ * nq();
    position_rates(y, y + n_ * nq(), ydot);
    accelerate(t, y, dv, nullptr);
    for (size_t i = 0; i < n_; ++i) {
      if (!alive_[i]) {
        std::fill_n(ydot + i * nq(), nq(), 0.0);
        std::fill_n(dv + i * nv(), nv(), 0.0);
      } else if (s_.any_motion) {
        rest_imposed(s_.model, s_.drives, ydot + i * nq(), dv + i * nv());
      }
    }
    return any_alive() ? Outcome::converged : ends_[0].outcome;
  }

  bool all_alive() const {
    for (const bool alive : alive_)
      if (!alive) return false;
    return true;
  }

  /// Rows of members that ended become those of one that did not, so that the lanes compute
  /// something sound there.
  void stand_in(double* y) const {
    size_t from = 0;
    while (from < n_ && !alive_[from]) ++from;
    for (size_t i = 0; i < n_ && from < n_; ++i) {
      if (alive_[i]) continue;
      std::copy_n(y + from * nq(), nq(), y + i * nq());
      std::copy_n(y + n_ * nq() + from * nv(), nv(), y + n_ * nq() + i * nv());
    }
  }

  void impose(double t, double* y) {
    if (!s_.any_motion) return;
    for (size_t i = 0; i < n_; ++i)
      impose_motion(s_.model, s_.drives, t, y + i * nq(), y + n_ * nq() + i * nv(),
                    a_.data() + i * nv());
  }

  /// Accelerations and loads of all rows; members whose evaluation fails end.
  void accelerate(double t, const double* y, double* du, double* loads) {
    const Model& m = s_.model;
    std::fill(external_.begin(), external_.end(), 0.0);
    for (size_t i = 0; i < n_; ++i) {
      const double *q = y + i * nq(), *v = y + n_ * nq() + i * nv();
      double* tau = tau_.data() + i * nv();
      if (constant_)
        std::copy_n(constant_ + i * nv(), nv(), tau);
      else
        std::fill_n(tau, nv(), 0.0);
      add_drive_torques(m, s_.drives, t, q, v, tau);
      std::copy_n(tau, nv(), drive_.data() + i * nv());
      add_passive_forces(m, q, v, tau);
      if (external_.empty()) continue;
      if (s_.world_wrenches) body_poses(m, q, poses_.data());
      add_wrenches(m, s_.wrenches, t, poses_.data(), external_.data() + i * n_load());
    }
    const bool sound = batch_.forward_dynamics(n_, input(y, 0), du, loads) < 0;
    for (size_t i = 0; i < n_; ++i) {
      if (!alive_[i]) continue;
      double* row = du + i * nv();
      double* load = loads ? loads + i * n_load() : nullptr;
      if (!sound && batch_.forward_dynamics(1, input(y, i), row, load) >= 0)
        end(i, Outcome::not_positive_definite);
      for (size_t k = 0; k < nv(); ++k)
        if (!(std::abs(row[k]) < largest_acceleration)) end(i, Outcome::not_finite);
    }
  }

  BatchInput input(const double* y, size_t row) const {
    BatchInput in;
    in.q = y + row * nq();
    in.v = y + n_ * nq() + row * nv();
    in.tau = tau_.data() + row * nv();
    in.du = a_.empty() ? nullptr : a_.data() + row * nv();
    in.external = external_.empty() ? nullptr : external_.data() + row * n_load();
    return in;
  }

  void position_rates(const double* q, const double* v, double* qdot) override {
    for (size_t i = 0; i < n_; ++i)
      for (const Element& e : s_.model.elements)
        element_position_rate(e, q + i * nq(), v + i * nv(), qdot + i * nq());
  }
  void normalise(double* y) override {
    for (size_t i = 0; i < n_; ++i) normalise_quaternions(s_.model, y + i * nq());
  }

  /// Row k of `count` of every member, from the state y_ at time t.
  void write(double t, size_t k, size_t count, const Sample& out) {
    if (out.acceleration || out.joint_load || out.drive_torque) {
      du_.resize(n_ * nv());
      loads_.resize(out.joint_load ? n_ * n_load() : 0);
      if (any_alive()) {
        stand_in(y_.data());
        accelerate(t, y_.data(), du_.data(), out.joint_load ? loads_.data() : nullptr);
        if (out.drive_torque) add_holding_torques();
      }
    }
    const auto put = [&](double* to, const double* from, size_t width, size_t i) {
      if (!to) return;
      to += (i * count + k) * width;
      for (size_t c = 0; c < width; ++c) to[c] = alive_[i] ? from[i * width + c] : nan;
    };
    for (size_t i = 0; i < n_; ++i) {
      const double *q = y_.data() + i * nq(), *v = y_.data() + n_ * nq() + i * nv();
      put(out.position, y_.data(), nq(), i);
      put(out.velocity, y_.data() + n_ * nq(), nv(), i);
      put(out.acceleration, du_.data(), nv(), i);
      put(out.joint_load, loads_.data(), n_load(), i);
      put(out.drive_torque, drive_.data(), nv(), i);
      if (out.kinetic_energy)
        out.kinetic_energy[i * count + k] = alive_[i] ? kinetic_energy(s_.model, q, v) : nan;
      if (out.potential_energy)
        out.potential_energy[i * count + k] = alive_[i] ? potential_energy(s_.model, q) : nan;
      if (alive_[i]) ends_[i].time = t;
    }
  }

  /// drive_ of joints whose motion is given: all that acts on them less what they do by themselves.
  void add_holding_torques() {
    if (!s_.driven_owner) return;
    if (!inverse_) inverse_ = std::make_unique<BatchEvaluator>(s_.model);
    total_.resize(n_ * nv());
    BatchInput in = input(y_.data(), 0);
    in.du = du_.data();
    inverse_->inverse_dynamics(n_, in, total_.data(), nullptr);
    for (int j = 0; j < s_.model.n_joints(); ++j) {
      if (!is_prescribed(s_.drives[j].kind)) continue;
      const JointInfo& info = s_.model.joints[j];
      for (size_t i = 0; i < n_; ++i)
        for (size_t k = i * nv() + info.v; k < i * nv() + info.v + info.nv; ++k)
          drive_[k] += total_[k] - tau_[k];
    }
  }

  const Shared& s_;
  const size_t n_;
  BatchEvaluator batch_;
  std::unique_ptr<BatchEvaluator> inverse_;
  std::unique_ptr<Integrator> integrator_;
  std::vector<Ending> ends_;
  std::vector<bool> alive_;
  const double* constant_;
  std::vector<double> tau_, drive_, a_, external_, poses_, y_, rows_, du_, loads_, total_;
};

/// The samples from member `first` on.
Sample from_member(const Sample& all, size_t first, size_t times, const Model& m) {
  const auto at = [&](double* p, size_t width) { return p ? p + first * times * width : nullptr; };
  Sample out;
  out.position = at(all.position, m.nq());
  out.velocity = at(all.velocity, m.nv());
  out.acceleration = at(all.acceleration, m.nv());
  out.joint_load = at(all.joint_load, load_width(m));
  out.drive_torque = at(all.drive_torque, m.nv());
  out.kinetic_energy = at(all.kinetic_energy, 1);
  out.potential_energy = at(all.potential_energy, 1);
  return out;
}

}  // namespace

void check_batch(const Simulation& simulation) {
  const SimulationOptions& options = simulation.options();
  for (const IntegratorEntry& entry : integrator_registry())
    if (entry.kind == options.integrator && !entry.fixed_step)
      throw InputError("integrator '" + std::string(entry.name) +
                       "' chooses its own steps; a batch takes runge_kutta_4 or "
                       "semi_implicit_euler");
  for (size_t j = 0; j < simulation.drives().size(); ++j)
    if (simulation.drives()[j].callable || simulation.drives()[j].motion)
      throw InputError("drives['" + simulation.model().joints[j].name +
                       "'] is a function; a batch takes numbers and tables");
  for (const Wrench& wrench : simulation.wrenches())
    if (wrench.callable)
      throw InputError("wrenches: a function is given; a batch takes numbers and tables");
}

std::vector<Ending> simulate_batch(std::span<const Simulation* const> simulations,
                                   size_t per_simulation, const BatchStart& start,
                                   std::span<const double> times, const Sample& samples,
                                   int threads, const std::function<bool()>& go_on) {
  std::vector<Ending> ends(simulations.size() * per_simulation);
  std::vector<std::unique_ptr<const Shared>> shared;
  for (size_t m = 0; m < simulations.size(); ++m) {
    check_batch(*simulations[m]);
    shared.push_back(std::make_unique<const Shared>(*simulations[m]));
    const Model& model = shared.back()->model;
    for (size_t i = m * per_simulation; i < (m + 1) * per_simulation; ++i) {
      check_quaternions(model, start.q + i * model.nq());
      check_locked_joints(model, shared.back()->drives, start.v + i * model.nv());
    }
  }
  const size_t groups = (per_simulation + native_lanes - 1) / native_lanes;
  parallel_for(static_cast<int>(groups * simulations.size()), threads, [&](int task) {
    const Shared& s = *shared[task / groups];
    const size_t begin = task % groups * native_lanes;
    const size_t n = std::min<size_t>(native_lanes, per_simulation - begin);
    const size_t first = task / groups * per_simulation + begin;
    const size_t nq = s.model.nq(), nv = s.model.nv();
    Group group(
        s, n,
        {start.q + first * nq, start.v + first * nv, start.tau ? start.tau + first * nv : nullptr});
    group.run(times, from_member(samples, first, times.size(), s.model), go_on);
    std::copy(group.ends().begin(), group.ends().end(), ends.begin() + first);
  });
  return ends;
}

}  // namespace linkwise
