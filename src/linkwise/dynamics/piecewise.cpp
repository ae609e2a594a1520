#include "linkwise/dynamics/piecewise.hpp"

#include <algorithm>

#include "linkwise/base/error.hpp"
#include "linkwise/constraint/joint_constraint.hpp"
#include "linkwise/dynamics/chain_pieces.hpp"
#include "linkwise/dynamics/piece_closure.hpp"
#include "linkwise/exec/executor.hpp"
#include "linkwise/recursion/piece_group.hpp"
#include "linkwise/solve/checked_solver.hpp"

namespace linkwise {

class PiecewiseChain {
 public:
  virtual ~PiecewiseChain() = default;
  virtual DynamicsReport evaluate(const SweepInput<double>& in, double* du, double* loads) = 0;
  virtual std::span<const double> constraint_force() const = 0;
  virtual const LoopStates& find_loops(const SweepInput<double>& in) = 0;
  virtual PieceClosure* closure() = 0;  ///< null: no loops
};

namespace {

using Group = Lanes<native_lanes>;

/// rows: of forces at the outboard end of a piece: those of a cut joint, or six where joints close
/// loops.
template <int rows>
class Chain final : public PiecewiseChain {
 public:
  static constexpr bool closes = rows == 6;

  Chain(const Model& model, const DynamicsOptions& options)
      : model_(model),
        executor_(options.executor.where_it_pays(Worth::region, model.n_bodies())),
        pieces_(model.n_bodies(), closes ? PieceClosure::end_bodies(model) : std::vector<int>()),
        n_pieces_(pieces_.count()),
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
      LaneBodies<Group> bodies(model, pieces_.length(),
                               [&](int k, int l) { return body_at(g, l, k); });
      // The first body of a piece of fillers must have an inertia to invert. It acts on nothing.
      std::array<int, native_lanes> last{};
      for (int l = 0; l < native_lanes; ++l)
        if (body_at(g, l, 0) < 0)
          set_lanes<Group>(bodies[0].body, l, unit_body());
        else
          last[l] = pieces_.size(g * native_lanes + l) - 1;
      groups_.emplace_back(std::move(bodies), last);
    }
    cuts_.resize(groups_.size());
    if (closes) {
      closure_.emplace(model, pieces_);
      closed_.resize(n_pieces_);
    }
  }

  PieceClosure* closure() override { return closes ? &*closure_ : nullptr; }

  const LoopStates& find_loops(const SweepInput<double>& in) override {
    in_ = in;
    place_pieces();
    return closure_->states();
  }

  DynamicsReport evaluate(const SweepInput<double>& given, double* du, double* loads) override {
    const SweepInput<double>& in = in_ = given;
    place_pieces();
    executor_.for_each(n_groups(), [&](int g) {
      groups_[g].calc_velocities(cuts_[g].ends.v_first);
      add_external(g);
      cuts_[g].answer =
          groups_[g].eliminate_joints([&](int k) { return gather(in.tau, g, k); }, cuts_[g].ends);
    });
    assemble();
    DynamicsReport report =
        closes ? solve_closed(loads != nullptr) : DynamicsReport{solver_.solve(A_, b_, f_)};
    for (const Cuts& cuts : cuts_)
      if (!cuts.answer.positive) report.outcome = Outcome::not_positive_definite;
    if (!report.ok() && report.outcome != Outcome::singular_position) {
      report.body = report.node >= 0 ? pieces_.first(report.node) : -1;
      return report;
    }
    spread_forces();
    executor_.for_each(n_groups(), [&](int g) {
      Cuts& cuts = cuts_[g];
      cuts.motion = groups_[g].accelerate_bodies(cuts.answer, cuts.forces, [&](int k, Group rate) {
        for (int l = 0; l < native_lanes; ++l)
          if (const int n = body_at(g, l, k); n >= 0) du[n] = rate[l];
      });
      if (loads) store_loads(g, loads);
    });
    cut_rates(du);
    if (closes && loads) closure_->store_loads(loads + 6 * model_.n_joints());
    return report;
  }

  std::span<const double> constraint_force() const override { return f_; }

 private:
  /// What the pieces of a group and the cut system say to each other.
  struct Cuts {
    PieceSpan<Group> span;
    PieceEnds<Group, rows> ends;
    PieceAnswer<Group, rows> answer;
    PieceForces<Group, rows> forces;
    PieceMotion<Group> motion;
  };

  /// Poses and velocities of the pieces' ends, and the loops there.
  void place_pieces() {
    executor_.for_each(n_groups(), [&](int g) {
      cuts_[g].span =
          groups_[g].across([&](int k) { return gather(in_.q, g, k); },
                            [&](int k) { return in_.v ? gather(in_.v, g, k) : Group{}; });
    });
    scan_velocities();
  }

  int n_groups() const { return static_cast<int>(groups_.size()); }
  /// Or -1.
  int body_at(int g, int l, int k) const { return pieces_.body_at(g * native_lanes + l, k); }
  Cuts& cuts(int piece) { return cuts_[piece / native_lanes]; }

  /// values[body] at position k of each piece; bodies and coordinates of a chain are numbered
  /// alike.
  Group gather(const double* values, int g, int k) const {
    Group out{};
    for (int l = 0; l < native_lanes; ++l)
      if (const int n = body_at(g, l, k); n >= 0) out[l] = values[n];
    return out;
  }

  void add_external(int g) {
    if (!in_.external) return;
    for (int l = 0; l < native_lanes; ++l)
      for (int k = 0; k < pieces_.size(g * native_lanes + l); ++k) {
        const int n = body_at(g, l, k);
        const Force<double> w = user_wrench(in_.external, model_.joints[n], n);
        groups_[g].add_wrench(k, l, {-w.lin, -w.ang});
      }
  }

  /// Velocities of the first bodies, piece after piece, and the geometry of the cut joints.
  void scan_velocities() {
    Motion<double> v_last{};
    for (int s = 0; s < n_pieces_; ++s) {
      const int n = pieces_.first(s), l = s % native_lanes;
      PieceEnds<Group, rows>& e = cuts(s).ends;
      clear_outboard(s);
      if (pieces_.size(s) == 0) {
        set_lanes<Group>(e.v_first, l, Motion<double>{});
        e.first_torque[l] = 0;
        pose_[s] = {Mat3<double>::identity(), {}};
        bias_[s] = {};
        if (closes) closed_[s].ends_chain = true;
        continue;
      }
      const double u = in_.v ? in_.v[n] : 0, tau = in_.tau ? in_.tau[n] : 0;
      const BodyConstants<double>& c = model_.constants[n];
      pose_[s] = RevoluteJoint::pose(c.tree, 0.0, in_.q[n]);
      Motion<double> v = pose_[s] * v_last;
      v.ang.z += u;
      bias_[s] = RevoluteJoint::bias(v, 0.0, u);
      set_lanes<Group>(e.v_first, l, v);
      e.first_torque[l] = tau;
      if (s > 0) set_outboard(s - 1, pose_[s], tau);
      const PieceSpan<Group>& span = cuts(s).span;
      const auto across = get_lanes<Transform<double>, Group>(span.across, l);
      v_last = across * v;
      v_last += get_lanes<Motion<double>, Group>(span.relative, l);
      if (closes) close_end(s, across, v_last);
    }
    if (closes) update_closure();
  }

  /// The inboard body feels -X^T (Q f + z tau) of the next piece's joint.
  void set_outboard(int s, const Transform<double>& X, double tau) {
    PieceEnds<Group, rows>& e = cuts(s).ends;
    for (int j = 0; j < rows; ++j) {
      double unit[6] = {};
      unit[j] = 1;
      const Force<double> w = transpose_times(X, to_force(unit));
      set_lanes<Group>(e.cut_columns[j], s % native_lanes, Motion<double>{w.lin, w.ang});
    }
    const Force<double> w = transpose_times(X, Force<double>{{}, {0, 0, tau}});
    set_lanes<Group>(e.known_outboard, s % native_lanes, Force<double>{-w.lin, -w.ang});
    if (closes && s >= 0) closed_[s].outboard = X;
  }
  void clear_outboard(int s) {
    PieceEnds<Group, rows>& e = cuts(s).ends;
    for (auto& column : e.cut_columns) set_lanes<Group>(column, s % native_lanes, Motion<double>{});
    set_lanes<Group>(e.known_outboard, s % native_lanes, Force<double>{});
  }

  bool ends_chain(int s) const { return s + 1 == n_pieces_ || pieces_.size(s + 1) == 0; }

  /// What loop joints see of the last body. Beyond the end of the chain they push in its own frame.
  void close_end(int s, const Transform<double>& across, const Motion<double>& v_last) {
    closed_[s].across = across * pose_[s];
    closed_[s].v_last = v_last;
    closed_[s].ends_chain = ends_chain(s);
    if (ends_chain(s)) set_outboard(s, {Mat3<double>::identity(), {}}, 0);
  }

  void update_closure() {
    closure_->update(in_, closed_);
    closure_->known_wrenches([&](int s, const Force<double>& w) {
      add_lanes<Group>(cuts(s).ends.known_outboard, s % native_lanes, w);
    });
  }

  void assemble() {
    const Motion<double> ground = ground_acceleration<double>(model_, in_.gravity_factor);
    for (int s = 0; s < n_pieces_; ++s) {
      const PieceResponse<Group, rows>& own = cuts(s).answer.response;
      const int l = s % native_lanes;
      const Motion<double> free = get_lanes<Motion<double>, Group>(own.a_free, l);
      const Motion<double> from_ground = pose_[s] * ground;
      // Pieces of fillers hang on nothing.
      const bool hangs = s > 0 && pieces_.size(s) > 0;
      const PieceResponse<Group, rows>* in = hangs ? &cuts(s - 1).answer.response : nullptr;
      const int li = (s + native_lanes - 1) % native_lanes;
      for (int i = 0; i < cut_rows; ++i) {
        for (int j = 0; j < cut_rows; ++j)
          A_.diag[s][block_stride * i + j] =
              own.QJQ[packed(i, j)][l] + (in ? in->PsiJPsi[packed(i, j)][li] : 0);
        b_[cut_rows * s + i] = to_array(bias_[s])[i] - to_array(free)[i] +
                               (in       ? in->beta[i][li]
                                : s == 0 ? to_array(from_ground)[i]
                                         : 0);
        if (in)
          for (int j = 0; j < cut_rows; ++j)
            A_.parent_block[s][block_stride * i + j] = -in->PsiJQ[cut_rows * i + j][li];
      }
    }
  }

  /// The cut forces with those of the loops.
  DynamicsReport solve_closed(bool with_loads) {
    DynamicsReport report;
    if constexpr (closes) {
      report.outcome = factor_.factor(A_);
      report.node = factor_.failed_node();
      if (!report.ok()) return report;
      for (int s = 0; s < n_pieces_; ++s)
        closed_[s].response = get_lanes<PieceResponse<double, rows>, Group>(cuts(s).answer.response,
                                                                            s % native_lanes);
      f_ = b_;
      factor_.solve_in_place(f_);
      closure_->solve(closed_, ground_acceleration<double>(model_, in_.gravity_factor), factor_, f_,
                      with_loads);
      report.loops = closure_->report();
      if (report.loops.is_contradictory()) report.outcome = Outcome::singular_position;
    }
    return report;
  }

  void spread_forces() {
    for (int s = 0; s < n_pieces_; ++s) {
      PieceForces<Group, rows>& forces = cuts(s).forces;
      const int l = s % native_lanes;
      const double* pushed = closes ? closure_->pushed(s) : nullptr;
      for (int j = 0; j < cut_rows; ++j) forces.first[j][l] = f_[cut_rows * s + j];
      for (int j = 0; j < rows; ++j)
        forces.outboard[j][l] = (j < cut_rows && !ends_chain(s) ? f_[cut_rows * (s + 1) + j] : 0) +
                                (pushed ? pushed[j] : 0);
    }
  }

  void cut_rates(double* du) {
    Motion<double> a = ground_acceleration<double>(model_, in_.gravity_factor);
    for (int s = 0; s < n_pieces_ && pieces_.size(s) > 0; ++s) {
      const int l = s % native_lanes;
      du[pieces_.first(s)] = get_lanes<Motion<double>, Group>(cuts(s).motion.first, l).ang.z -
                             (pose_[s] * a).ang.z - bias_[s].ang.z;
      a = get_lanes<Motion<double>, Group>(cuts(s).motion.last, l);
    }
  }

  void store_loads(int g, double* loads) {
    groups_[g].calc_loads(cuts_[g].ends, cuts_[g].forces);
    for (int l = 0; l < native_lanes; ++l)
      for (int k = 0; k < pieces_.size(g * native_lanes + l); ++k) {
        const int n = body_at(g, l, k);  // and the number of its joint
        store_joint_load(model_, n, in_.q, groups_[g].joint_load(k, l), loads + 6 * n);
      }
  }

  const Model& model_;
  Executor executor_;
  ChainPieces pieces_;
  int n_pieces_;
  std::vector<PieceGroup<Group, rows>> groups_;
  std::vector<Cuts> cuts_;               ///< by group
  std::vector<Transform<double>> pose_;  ///< across the cut joints
  std::vector<Motion<double>> bias_;     ///< c of the cut joints
  BlockTree A_;
  std::vector<double> b_, f_;
  CheckedSolver solver_;
  TreeFactor factor_;  ///< of A, where loops close
  std::optional<PieceClosure> closure_;
  std::vector<ClosedPiece> closed_;
  SweepInput<double> in_;
};

/// Only the direct solver answers each loop joint's forces as well.
void require_thomas(const DynamicsOptions& options) {
  if (options.solver.empty() || options.solver == "auto" || options.solver == "thomas") return;
  throw InputError("method piecewise closes loops with solver thomas; leave solver " +
                   options.solver + " out, or use method constraint_force");
}

}  // namespace

Piecewise::Piecewise(const Model& model, const DynamicsOptions& options) {
  require_regular_inertias(model, "piecewise");
  if (!suits(model))
    throw InputError("method piecewise takes a chain of at least " + std::to_string(min_bodies) +
                     " revolute joints without armature, with few loops, and model '" +
                     model.spec().name + "'" + model.where() +
                     " is not one; use method articulated_body");
  if (model.n_loops() == 0) {
    chain_ = std::make_unique<Chain<cut_rows>>(model, options);
    return;
  }
  require_thomas(options);
  at_rest_.resize(model.nv());
  chain_ = std::make_unique<Chain<6>>(model, options);
}

Piecewise::~Piecewise() = default;

DynamicsReport Piecewise::evaluate(double, const SweepInput<double>& in, double* du,
                                   double* loads) {
  return chain_->evaluate(in, du, loads);
}

bool Piecewise::finds_loops() const { return chain_->closure() != nullptr; }

const LoopStates& Piecewise::find_loops(const SweepInput<double>& in) {
  return chain_->find_loops(in);
}

const LoopReport& Piecewise::loop_report() const { return chain_->closure()->report(); }

bool Piecewise::respond(const double* q, const double* asked, double null, double* du) {
  SweepInput<double> in;
  in.q = q;
  in.tau = at_rest_.data();
  in.gravity_factor = 0;
  chain_->closure()->ask(asked, null);
  const DynamicsReport report = chain_->evaluate(in, du, nullptr);
  chain_->closure()->ask(nullptr, 0);
  return report.ok() || report.outcome == Outcome::singular_position;
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
  if (model.singular_body() >= 0 || model.n_couplings() > 0 || !model.bearings.empty())
    return false;
  int rows = 0;
  for (const LoopJoint& loop : model.loops.joints) rows += loop_rows(model, loop);
  return rows <= PieceClosure::most_rows;
}

bool Piecewise::closes_cheaply(const Model& model) {
  if (!suits(model)) return false;
  int rows = 0;
  for (const LoopJoint& loop : model.loops.joints) rows += loop_rows(model, loop);
  const int ends = static_cast<int>(PieceClosure::end_bodies(model).size());
  return model.n_bodies() >= std::max({worth_cutting, 4 * rows, 16 * ends});
}

int Piecewise::pieces(int n_bodies) { return ChainPieces::wanted(n_bodies); }

}  // namespace linkwise
