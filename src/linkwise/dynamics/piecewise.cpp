#include "linkwise/dynamics/piecewise.hpp"

#include "linkwise/base/error.hpp"
#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/exec/executor.hpp"
#include "linkwise/recursion/piece_group.hpp"
#include "linkwise/solve/checked_solver.hpp"

namespace linkwise {
namespace {

using Group = Lanes<native_lanes>;

}  // namespace

class PiecewiseChain {
 public:
  PiecewiseChain(const Model& model, const DynamicsOptions& options)
      : model_(model),
        executor_(options.executor.where_it_pays(Worth::region, model.n_bodies())),
        n_(model.n_bodies()),
        n_pieces_(Piecewise::pieces(n_)),
        length_((n_ + n_pieces_ - 1) / n_pieces_),
        pose_(n_pieces_),
        bias_(n_pieces_),
        solver_(options.solver.empty() || options.solver == "auto" ? "thomas" : options.solver,
                options.solver_options, false) {
    std::vector<int> parent, dim(n_pieces_, cut_rows);
    for (int s = 0; s < n_pieces_; ++s) parent.push_back(s - 1);
    A_.set_structure(parent, dim);
    b_.resize(A_.size());
    f_.resize(A_.size());
    for (int g = 0; g < (n_pieces_ + native_lanes - 1) / native_lanes; ++g) {
      LaneBodies<Group> bodies(model, length_, [&](int k, int l) { return body_at(g, l, k); });
      // The first body of a piece of fillers must have an inertia to invert. It acts on nothing.
      for (int l = 0; l < native_lanes; ++l)
        if (body_at(g, l, 0) >= n_) set_lanes<Group>(bodies[0].body, l, unit_body());
      groups_.emplace_back(std::move(bodies));
    }
    cuts_.resize(groups_.size());
  }

  DynamicsReport evaluate(const SweepInput<double>& in, double* du, double* loads) {
    in_ = &in;
    executor_.for_each(n_groups(), [&](int g) {
      cuts_[g].span = groups_[g].across([&](int k) { return gather(in.q, g, k); },
                                        [&](int k) { return in.v ? gather(in.v, g, k) : Group{}; });
    });
    scan_velocities();
    executor_.for_each(n_groups(), [&](int g) {
      groups_[g].calc_velocities(cuts_[g].ends.v_first);
      add_external(g);
      cuts_[g].answer =
          groups_[g].eliminate_joints([&](int k) { return gather(in.tau, g, k); }, cuts_[g].ends);
    });
    assemble();
    DynamicsReport report{solver_.solve(A_, b_, f_)};
    for (const Cuts& cuts : cuts_)
      if (!cuts.answer.positive) report.outcome = Outcome::not_positive_definite;
    if (!report.ok()) {
      report.body = report.node >= 0 ? first(report.node) : -1;
      return report;
    }
    spread_forces();
    executor_.for_each(n_groups(), [&](int g) {
      Cuts& cuts = cuts_[g];
      cuts.motion = groups_[g].accelerate_bodies(cuts.answer, cuts.forces, [&](int k, Group rate) {
        for (int l = 0; l < native_lanes; ++l)
          if (const int n = body_at(g, l, k); n < n_) du[n] = rate[l];
      });
      if (loads) store_loads(g, loads);
    });
    cut_rates(du);
    return report;
  }

  std::span<const double> constraint_force() const { return f_; }

 private:
  /// What the pieces of a group and the cut system say to each other.
  struct Cuts {
    PieceSpan<Group> span;
    PieceEnds<Group> ends;
    PieceAnswer<Group> answer;
    PieceForces<Group> forces;
    PieceMotion<Group> motion;
  };

  int n_groups() const { return static_cast<int>(groups_.size()); }
  int first(int piece) const { return piece * length_; }
  int body_at(int g, int l, int k) const { return (g * native_lanes + l) * length_ + k; }
  Cuts& cuts(int piece) { return cuts_[piece / native_lanes]; }

  /// values[body] at position k of each piece; bodies and coordinates of a chain are numbered
  /// alike.
  Group gather(const double* values, int g, int k) const {
    Group out{};
    for (int l = 0; l < native_lanes; ++l)
      if (const int n = body_at(g, l, k); n < n_) out[l] = values[n];
    return out;
  }

  void add_external(int g) {
    if (!in_->external) return;
    for (int l = 0; l < native_lanes; ++l)
      for (int k = 0; k < length_; ++k) {
        const int n = body_at(g, l, k);
        if (n >= n_) return;
        const Force<double> w = user_wrench(in_->external, model_.joints[n], n);
        groups_[g].add_wrench(k, l, {-w.lin, -w.ang});
      }
  }

  /// Velocities of the first bodies, piece after piece, and the geometry of the cut joints.
  void scan_velocities() {
    Motion<double> v_last{};
    for (int s = 0; s < n_pieces_; ++s) {
      const int n = first(s), l = s % native_lanes;
      PieceEnds<Group>& e = cuts(s).ends;
      if (n >= n_) {
        set_lanes<Group>(e.v_first, l, Motion<double>{});
        for (auto& column : e.cut_columns) set_lanes<Group>(column, l, Motion<double>{});
        set_lanes<Group>(e.known_outboard, l, Force<double>{});
        e.first_torque[l] = 0;
        pose_[s] = {Mat3<double>::identity(), {}};
        bias_[s] = {};
        if (s > 0) clear_outboard(s - 1);
        continue;
      }
      const double u = in_->v ? in_->v[n] : 0, tau = in_->tau[n];
      const BodyConstants<double>& c = model_.constants[n];
      pose_[s] = RevoluteJoint::pose(c.tree, 0.0, in_->q[n]);
      Motion<double> v = pose_[s] * v_last;
      v.ang.z += u;
      bias_[s] = RevoluteJoint::bias(v, 0.0, u);
      set_lanes<Group>(e.v_first, l, v);
      e.first_torque[l] = tau;
      if (s > 0) set_outboard(s - 1, pose_[s], tau);
      const PieceSpan<Group>& span = cuts(s).span;
      v_last = get_lanes<Transform<double>, Group>(span.across, l) * v;
      v_last += get_lanes<Motion<double>, Group>(span.relative, l);
    }
    clear_outboard(n_pieces_ - 1);
  }

  /// The inboard body feels -X^T (Q f + z tau) of the next piece's joint.
  void set_outboard(int s, const Transform<double>& X, double tau) {
    PieceEnds<Group>& e = cuts(s).ends;
    for (int j = 0; j < cut_rows; ++j) {
      double unit[6] = {};
      unit[j] = 1;
      const Force<double> w = transpose_times(X, to_force(unit));
      set_lanes<Group>(e.cut_columns[j], s % native_lanes, Motion<double>{w.lin, w.ang});
    }
    const Force<double> w = transpose_times(X, Force<double>{{}, {0, 0, tau}});
    set_lanes<Group>(e.known_outboard, s % native_lanes, Force<double>{-w.lin, -w.ang});
  }
  void clear_outboard(int s) {
    PieceEnds<Group>& e = cuts(s).ends;
    for (auto& column : e.cut_columns) set_lanes<Group>(column, s % native_lanes, Motion<double>{});
    set_lanes<Group>(e.known_outboard, s % native_lanes, Force<double>{});
  }

  void assemble() {
    const Motion<double> ground = ground_acceleration<double>(model_, in_->gravity_factor);
    for (int s = 0; s < n_pieces_; ++s) {
      const PieceAnswer<Group>& own = cuts(s).answer;
      const int l = s % native_lanes;
      const Motion<double> free = get_lanes<Motion<double>, Group>(own.a_free, l);
      const Motion<double> from_ground = pose_[s] * ground;
      const PieceAnswer<Group>* in = s > 0 ? &cuts(s - 1).answer : nullptr;
      const int li = (s + native_lanes - 1) % native_lanes;
      for (int i = 0; i < cut_rows; ++i) {
        for (int j = 0; j < cut_rows; ++j)
          A_.diag[s][block_stride * i + j] =
              own.QJQ[packed(i, j)][l] + (in ? in->PsiJPsi[packed(i, j)][li] : 0);
        b_[cut_rows * s + i] = to_array(bias_[s])[i] - to_array(free)[i] +
                               (in ? in->beta[i][li] : to_array(from_ground)[i]);
        if (in)
          for (int j = 0; j < cut_rows; ++j)
            A_.parent_block[s][block_stride * i + j] = -in->PsiJQ[5 * i + j][li];
      }
    }
  }

  void spread_forces() {
    for (int s = 0; s < n_pieces_; ++s)
      for (int j = 0; j < cut_rows; ++j) {
        PieceForces<Group>& forces = cuts(s).forces;
        forces.first[j][s % native_lanes] = f_[cut_rows * s + j];
        forces.outboard[j][s % native_lanes] = s + 1 < n_pieces_ ? f_[cut_rows * (s + 1) + j] : 0;
      }
  }

  void cut_rates(double* du) {
    Motion<double> a = ground_acceleration<double>(model_, in_->gravity_factor);
    for (int s = 0; s < n_pieces_ && first(s) < n_; ++s) {
      const int l = s % native_lanes;
      du[first(s)] = get_lanes<Motion<double>, Group>(cuts(s).motion.first, l).ang.z -
                     (pose_[s] * a).ang.z - bias_[s].ang.z;
      a = get_lanes<Motion<double>, Group>(cuts(s).motion.last, l);
    }
  }

  void store_loads(int g, double* loads) {
    groups_[g].calc_loads(cuts_[g].ends, cuts_[g].forces);
    for (int l = 0; l < native_lanes; ++l)
      for (int k = 0; k < length_; ++k) {
        const int n = body_at(g, l, k);  // and the number of its joint
        if (n >= n_) return;
        store_joint_load(model_, n, in_->q, groups_[g].joint_load(k, l), loads + 6 * n);
      }
  }

  const Model& model_;
  Executor executor_;
  int n_, n_pieces_, length_;
  std::vector<PieceGroup<Group>> groups_;
  std::vector<Cuts> cuts_;               ///< by group
  std::vector<Transform<double>> pose_;  ///< across the cut joints
  std::vector<Motion<double>> bias_;     ///< c of the cut joints
  BlockTree A_;
  std::vector<double> b_, f_;
  CheckedSolver solver_;
  const SweepInput<double>* in_ = nullptr;
};

Piecewise::Piecewise(const Model& model, const DynamicsOptions& options) {
  require_regular_inertias(model, "piecewise");
  if (!suits(model))
    throw InputError("method piecewise takes a chain of at least " + std::to_string(min_bodies) +
                     " revolute joints without armature, and model '" + model.spec().name + "'" +
                     model.where() + " is not one; use articulated_body");
  chain_ = std::make_unique<PiecewiseChain>(model, options);
}

Piecewise::~Piecewise() = default;

DynamicsReport Piecewise::evaluate(double, const SweepInput<double>& in, double* du,
                                   double* loads) {
  return chain_->evaluate(in, du, loads);
}

std::span<const double> Piecewise::constraint_force() const { return chain_->constraint_force(); }

bool Piecewise::suits(const Model& model) {
  if (model.n_bodies() < min_bodies || model.n_joints() != model.n_bodies()) return false;
  for (int n = 0; n < model.n_bodies(); ++n) {
    const BodyTopology& body = model.topology[n];
    const bool kind = body.joint_kind == JointKind::hinge || body.joint_kind == JointKind::revolute;
    if (!kind || body.body_kind != BodyKind::rigid || body.parent != n - 1 || body.q != n)
      return false;
  }
  return model.singular_body() < 0;
}

int Piecewise::pieces(int n_bodies) {
  // Eight pieces fill the widest lanes. There are more only if they are long enough to hide the cut
  // system.
  int pieces = 8;
  while (pieces < 1024 && n_bodies / pieces > 128) pieces *= 2;
  return pieces;
}

}  // namespace linkwise
