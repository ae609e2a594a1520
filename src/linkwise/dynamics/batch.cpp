#include "linkwise/dynamics/batch.hpp"

#include <algorithm>
#include <vector>

#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/constraint_elimination.hpp"
#include "linkwise/dynamics/inverse_dynamics.hpp"
#include "linkwise/forces/armature_bias.hpp"
#include "linkwise/simd/rows.hpp"

namespace linkwise {

struct BatchEvaluator::Work {
  explicit Work(const Model& model) : model_(&model), armature_bias_(has_armature_bias(model)) {}

  /// tau with factor times the bias of the armatures, one row per system.
  std::vector<double> biased(size_t count, const BatchInput& in, const double* tau,
                             double factor) const {
    std::vector<double> rows(count * nv());
    if (tau) std::copy_n(tau, rows.size(), rows.begin());
    for (size_t i = 0; i < count && in.v; ++i)
      add_armature_bias(*model_, in.v + i * nv(), factor, rows.data() + i * nv());
    return rows;
  }
  bool armature_bias() const { return armature_bias_; }

  template <class Scalar, class OnLanes>
  int forward_dynamics(std::unique_ptr<Scalar>& scalar, std::unique_ptr<OnLanes>& on_lanes,
                       size_t count, const BatchInput& in, double* du, double* loads) {
    int failed = -1;
    over_groups(
        count, in,
        [&](const SweepInput<double>& one, size_t i) {
          auto& kernel = made(scalar);
          if (!kernel.evaluate(one, du + i * nv(), loads ? loads + i * load_width() : nullptr))
            failed = kernel.failed_body();
        },
        [&](const SweepInput<Group>& group, size_t i) {
          auto& kernel = made(on_lanes);
          if (!kernel.evaluate(group, out_a(), loads ? out_b() : nullptr))
            failed = kernel.failed_body();
          unpack(out_a(), nv(), i, count, du);
          if (loads) unpack(out_b(), load_width(), i, count, loads);
        });
    return failed;
  }

  template <class Scalar, class OnLanes>
  int loads_by_cause(std::unique_ptr<Scalar>& scalar, std::unique_ptr<OnLanes>& on_lanes,
                     size_t count, const BatchInput& in, std::span<const Cause> causes,
                     double* loads) {
    int failed = -1;
    const size_t stride = causes.size() * load_width();
    std::vector<double> bias;
    if (armature_bias_) bias = biased(count, in, nullptr, -1);
    over_groups(
        count, in,
        [&](const SweepInput<double>& one, size_t i) {
          std::vector<double> none(nv()), du(nv());
          const double* passive = in.passive ? in.passive + i * nv() : nullptr;
          const double* turning = armature_bias_ ? bias.data() + i * nv() : none.data();
          size_t c = 0;
          const auto out = [&] { return loads + i * stride + c * load_width(); };
          if (!each_alone(made(scalar), one, {none.data(), turning, passive}, causes, du.data(),
                          out, [&] { ++c; }))
            failed = scalar->failed_body();
        },
        [&](const SweepInput<Group>& group, size_t i) {
          none_.resize(nv());
          const Group* passive = pack(passive_, in.passive, nv(), i, count);
          const Group* turning =
              armature_bias_ ? pack(bias_, bias.data(), nv(), i, count) : none_.data();
          size_t c = 0;
          const auto store = [&] {
            unpack(out_b(), load_width(), i, count, loads + c++ * load_width(), stride);
          };
          if (!each_alone(
                  made(on_lanes), group, {none_.data(), turning, passive}, causes, out_a(),
                  [&] { return out_b(); }, store))
            failed = on_lanes->failed_body();
        });
    return failed;
  }

  void inverse_dynamics(size_t count, const BatchInput& in, double* tau, double* loads) {
    over_groups(
        count, in,
        [&](const SweepInput<double>& one, size_t i) {
          made(inverse_).evaluate(one, in.du ? in.du + i * nv() : nullptr,
                                  tau ? tau + i * nv() : nullptr,
                                  loads ? loads + i * load_width() : nullptr);
        },
        [&](const SweepInput<Group>& group, size_t i) {
          made(inverse_lanes_)
              .evaluate(group, pack(du_, in.du, nv(), i, count), tau ? out_a() : nullptr,
                        loads ? out_b() : nullptr);
          if (tau) unpack(out_a(), nv(), i, count, tau);
          if (loads) unpack(out_b(), load_width(), i, count, loads);
        });
    for (size_t i = 0; i < count && armature_bias_ && tau && in.v; ++i)
      add_armature_bias(*model_, in.v + i * nv(), 1, tau + i * nv());
  }

  using Group = Lanes<native_lanes>;
  std::unique_ptr<ArticulatedBody<double>> articulated;
  std::unique_ptr<ArticulatedBody<Group>> articulated_lanes;
  std::unique_ptr<ConstraintElimination<double>> elimination;
  std::unique_ptr<ConstraintElimination<Group>> elimination_lanes;

 private:
  size_t nq() const { return model_->nq(); }
  size_t nv() const { return model_->nv(); }
  size_t load_width() const { return 6 * static_cast<size_t>(model_->n_joints()); }

  template <class Kernel>
  Kernel& made(std::unique_ptr<Kernel>& kernel) {
    if (!kernel) kernel = std::make_unique<Kernel>(*model_);
    return *kernel;
  }

  Group* out_a() {
    out_a_.resize(nv());
    return out_a_.data();
  }
  Group* out_b() {
    out_b_.resize(load_width());
    return out_b_.data();
  }

  /// Systems i ... i + lanes - 1 of rows of length n; beyond the end the last one is repeated.
  const Group* pack(std::vector<Group>& to, const double* from, size_t n, size_t i, size_t count) {
    if (!from) return nullptr;
    to.resize(n);
    const double* rows[native_lanes];
    for (int l = 0; l < native_lanes; ++l) rows[l] = from + std::min(i + l, count - 1) * n;
    for (size_t k = 0; k < n; ++k)
      for (int l = 0; l < native_lanes; ++l) to[k][l] = rows[l][k];
    return to.data();
  }
  void unpack(const Group* from, size_t n, size_t i, size_t count, double* to) {
    unpack(from, n, i, count, to, n);
  }
  void unpack(const Group* from, size_t n, size_t i, size_t count, double* to, size_t stride) {
    const int lanes = static_cast<int>(std::min<size_t>(native_lanes, count - i));
    lanes_to_rows(from, n, lanes, to + i * stride, stride);
  }

  /// Torques [nv] that belong to causes: to none, to velocities (of armatures), to passive forces.
  template <class S>
  struct Torques {
    const S *none, *velocity, *passive;
  };

  /// The part of `all` that belongs to one cause.
  template <class S>
  static SweepInput<S> alone(Cause cause, const SweepInput<S>& all, const Torques<S>& torques) {
    SweepInput<S> in;
    in.q = all.q;
    in.tau = cause == Cause::velocity ? torques.velocity : torques.none;
    in.gravity_factor = 0;
    if (cause == Cause::gravity) in.gravity_factor = all.gravity_factor;
    if (cause == Cause::velocity) in.v = all.v;
    if (cause == Cause::drive && all.tau) in.tau = all.tau;
    if (cause == Cause::motion) in.prescribed = all.prescribed;
    if (cause == Cause::passive && torques.passive) in.tau = torques.passive;
    if (cause == Cause::external) in.external = all.external;
    return in;
  }

  /// Loads of each cause into out(), after which done() is called. False: not positive definite.
  template <class Kernel, class S, class Out, class Done>
  static bool each_alone(Kernel& kernel, const SweepInput<S>& all, const Torques<S>& torques,
                         std::span<const Cause> causes, S* du, Out&& out, Done&& done) {
    bool eliminated = false;
    for (const Cause cause : causes) {
      const SweepInput<S> in = alone(cause, all, torques);
      if (eliminated)
        kernel.evaluate_again(in, du, out());
      else if (!kernel.evaluate(in, du, out()))
        return false;
      eliminated = true;
      done();
    }
    return true;
  }

  template <class One, class Several>
  void over_groups(size_t count, const BatchInput& in, One&& one, Several&& several) {
    size_t i = 0;
    while (i < count) {
      if (count - i == 1) {
        SweepInput<double> s;
        s.q = in.q + i * nq();
        s.v = in.v ? in.v + i * nv() : nullptr;
        s.tau = in.tau ? in.tau + i * nv() : nullptr;
        s.prescribed = in.prescribed ? in.prescribed + i * nv() : nullptr;
        s.external = in.external ? in.external + i * load_width() : nullptr;
        s.gravity_factor = in.gravity_factor;
        one(s, i);
        return;
      }
      SweepInput<Group> s;
      s.q = pack(q_, in.q, nq(), i, count);
      s.v = pack(v_, in.v, nv(), i, count);
      s.tau = pack(tau_, in.tau, nv(), i, count);
      s.prescribed = pack(prescribed_, in.prescribed, nv(), i, count);
      s.external = pack(external_, in.external, load_width(), i, count);
      s.gravity_factor = in.gravity_factor;
      several(s, i);
      i += native_lanes;
    }
  }

  const Model* model_;
  bool armature_bias_;
  std::unique_ptr<InverseDynamics<double>> inverse_;
  std::unique_ptr<InverseDynamics<Group>> inverse_lanes_;
  std::vector<Group> q_, v_, tau_, du_, prescribed_, external_, passive_, bias_, none_, out_a_,
      out_b_;
};

BatchInput BatchInput::from(const Model& model, size_t first) const {
  const auto rows = [&](const double* all, size_t width) {
    return all ? all + first * width : nullptr;
  };
  const size_t nv = model.nv();
  BatchInput part = *this;
  part.q = rows(q, model.nq());
  part.loop_tau = rows(loop_tau, model.loops.nv);
  part.loop_prescribed = rows(loop_prescribed, model.loops.nv);
  part.external = rows(external, 6 * static_cast<size_t>(model.n_joints()));
  for (const double** row : {&part.v, &part.tau, &part.du, &part.prescribed, &part.passive})
    *row = rows(*row, nv);
  return part;
}

BatchEvaluator::BatchEvaluator(const Model& model) : work_(std::make_unique<Work>(model)) {}
BatchEvaluator::~BatchEvaluator() = default;

int BatchEvaluator::forward_dynamics(size_t count, const BatchInput& in, double* du, double* loads,
                                     BatchMethod method) {
  Work& w = *work_;
  std::vector<double> tau;
  BatchInput biased = in;
  if (w.armature_bias()) {
    tau = w.biased(count, in, in.tau, -1);
    biased.tau = tau.data();
  }
  return method == BatchMethod::constraint_force
             ? w.forward_dynamics(w.elimination, w.elimination_lanes, count, biased, du, loads)
             : w.forward_dynamics(w.articulated, w.articulated_lanes, count, biased, du, loads);
}

int BatchEvaluator::loads_by_cause(size_t count, const BatchInput& in,
                                   std::span<const Cause> causes, double* loads,
                                   BatchMethod method) {
  Work& w = *work_;
  return method == BatchMethod::constraint_force
             ? w.loads_by_cause(w.elimination, w.elimination_lanes, count, in, causes, loads)
             : w.loads_by_cause(w.articulated, w.articulated_lanes, count, in, causes, loads);
}

void BatchEvaluator::inverse_dynamics(size_t count, const BatchInput& in, double* tau,
                                      double* loads) {
  work_->inverse_dynamics(count, in, tau, loads);
}

}  // namespace linkwise
