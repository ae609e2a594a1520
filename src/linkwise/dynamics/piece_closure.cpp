#include "linkwise/dynamics/piece_closure.hpp"

#include <algorithm>
#include <cmath>

namespace linkwise {
namespace {

/// Symmetric, packed.
double element(const double* m, int i, int j) { return i > j ? m[packed(i, j)] : m[packed(j, i)]; }

/// All loop joints that hold anything, of which each couples with each.
LoopGroup one_group(const Model& model) {
  LoopGroup group;
  for (int l = 0; l < model.n_loops(); ++l) {
    const LoopJoint& loop = model.loops.joints[l];
    const int rows = loop_rows(model, loop);
    if (rows == 0) continue;
    group.members.push_back({l, -1, group.rows, rows, {}});
    group.rows += rows;
    group.rotors += loop_rotors(model, loop);
  }
  LoopGroup::Carrier all{0, {}, 0, {}};
  for (int i = 0; i < group.rows; ++i) all.rows.push_back(i);
  if (group.rows > 0) group.carriers.push_back(std::move(all));
  return group;
}

}  // namespace

std::vector<int> PieceClosure::end_bodies(const Model& model) {
  std::vector<int> bodies;
  for (const LoopJoint& loop : model.loops.joints)
    for (const int body : {loop.parent_body, loop.joint.body})
      if (body >= 0) bodies.push_back(body);
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

PieceClosure::PieceClosure(const Model& model, const ChainPieces& pieces)
    : model_(model),
      states_(model),
      metric_(model),
      torques_(model),
      port_of_(pieces.count(), -1),
      n_cut_(cut_rows * pieces.count()),
      group_(one_group(model)),
      at_(model.n_loops()) {
  for (const int body : end_bodies(model)) port_of_[pieces.ended_by(body)] = n_ports_++;
  for (const LoopJoint& loop : model.loops.joints)
    ends_.push_back({loop.parent_body < 0 ? -1 : pieces.ended_by(loop.parent_body),
                     loop.joint.body < 0 ? -1 : pieces.ended_by(loop.joint.body)});
  system_.emplace(group_);
  const auto rows = static_cast<size_t>(group_.rows);
  w_.resize(rows * n_ports_ * 6);
  F_.resize(rows * n_cut_);
  push_.resize(6 * static_cast<size_t>(n_ports_));
  Lambda_.resize(rows * rows);
  for (auto* x : {&r_, &size_, &phi_}) x->resize(rows);
  driven_.resize(rows);
}

void PieceClosure::update(SweepInput<double>& in, std::span<const ClosedPiece> pieces) {
  for (size_t l = 0; l < ends_.size(); ++l) {
    const auto [a, b] = ends_[l];
    LoopEnds& at = at_[l];
    at.X_a = at.X_b = {Mat3<double>::identity(), {}};
    Transform<double>& X = a > b ? at.X_a : at.X_b;
    for (int s = std::min(a, b) + 1; s <= std::max(a, b); ++s) X = pieces[s].across * X;
    at.v_a = a >= 0 ? pieces[a].v_last : Motion<double>{};
    at.v_b = b >= 0 ? pieces[b].v_last : Motion<double>{};
  }
  states_.update(in, at_.data());
  if (in.on_loops) in.on_loops->found(states_, in);
  torques_.update(in, states_);
}

/// The components of unit forces, and what the rows ask beyond what the chain does by itself.
void PieceClosure::place_forces(std::span<const ClosedPiece> pieces, const Motion<double>& ground,
                                std::span<const double> f) {
  std::fill(w_.begin(), w_.end(), 0.0);
  const auto free_motion = [&](int s, double* a) {
    const PieceResponse<double, 6>& of = pieces[s].response;
    const double *first = &f[cut_rows * s], *outboard = pieces[s].ends_chain ? nullptr : first + 5;
    for (int i = 0; i < 6; ++i) {
      a[i] = of.beta[i];
      for (int j = 0; j < cut_rows; ++j) a[i] += of.PsiJQ[cut_rows * i + j] * first[j];
      for (int j = 0; outboard && j < cut_rows; ++j)
        a[i] -= element(of.PsiJPsi, i, j) * outboard[j];
    }
  };
  for (const auto& member : group_.members) {
    const LoopState& loop = states_[member.loop];
    const LoopJoint& joint = model_.loops.joints[member.loop];
    const auto [a, b] = ends_[member.loop];
    double of_a[6], of_b[6];
    if (a >= 0) free_motion(a, of_a);
    if (b >= 0) free_motion(b, of_b);
    for (int i = 0; i < member.n_rows; ++i) {
      const int j = member.row + i;
      const Force<double> Q = direction(loop.row[i]);
      r_[j] = asked_ ? asked_[6 * member.loop + i] : loop.r[i];
      size_[j] = std::abs(r_[j]);
      const auto add = [&](int s, const Force<double>& wrench, const double* free) {
        double part = 0;
        if (s < 0) {
          part = dot(ground, wrench);
        } else {
          const Vector6<double> on_cut =
              to_array(inverse_transpose_times(pieces[s].outboard, wrench));
          for (int k = 0; k < 6; ++k) {
            at_port(j, s)[k] -= on_cut[k];
            part += on_cut[k] * free[k];
          }
        }
        r_[j] -= part;
        size_[j] += std::abs(part);
      };
      add(a, wrench_on_a(loop, Q), of_a);
      add(b, wrench_on_b(joint, Q), of_b);
    }
  }
}

/// F: the cut forces that go with unit forces.
void PieceClosure::ask_cuts(std::span<const ClosedPiece> pieces, TreeFactor& A) {
  std::fill(F_.begin(), F_.end(), 0.0);
  for (int j = 0; j < group_.rows; ++j) {
    double* const F = column(j);
    for (size_t s = 0; s < pieces.size(); ++s) {
      if (port_of_[s] < 0) continue;
      const PieceResponse<double, 6>& of = pieces[s].response;
      const double* w = at_port(j, static_cast<int>(s));
      double* const own = F + cut_rows * s;
      for (int i = 0; i < cut_rows; ++i)
        for (int k = 0; k < 6; ++k) {
          own[i] += of.PsiJQ[cut_rows * k + i] * w[k];
          if (!pieces[s].ends_chain) own[cut_rows + i] -= element(of.PsiJPsi, i, k) * w[k];
        }
    }
    A.solve_in_place({F, static_cast<size_t>(n_cut_)});
  }
}

/// What a piece adds to Lambda.
void PieceClosure::add_energy(const ClosedPiece& piece, int s) {
  const PieceResponse<double, 6>& of = piece.response;
  const int rows = group_.rows;
  for (int j = 0; j < rows; ++j) {
    Driven& d = driven_[j];
    const double* const first = column(j) + cut_rows * s;
    for (int k = 0; k < 6; ++k)
      d.outboard[k] = k < cut_rows && !piece.ends_chain ? first[cut_rows + k] : 0;
    if (port_of_[s] >= 0)
      for (int k = 0; k < 6; ++k) d.outboard[k] += at_port(j, s)[k];
    d.g = {{first[0], first[1], first[2]}, {first[3], first[4], 0}};
    d.a = {};
    for (int k = 0; k < cut_rows; ++k) d.a += first[k] * of.JQ[k];
    for (int k = 0; k < 6; ++k) {
      const double x = d.outboard[k];
      d.g -= x * of.cut.Psi[k];
      d.a += -x * of.JPsi[k];
      d.held[k] = 0;
      for (int i = 0; i < 6; ++i) d.held[k] += element(of.cut.Lambda, k, i) * d.outboard[i];
    }
    for (int i = 0; i <= j; ++i) {
      double sum = dot(d.a, driven_[i].g);
      for (int k = 0; k < 6; ++k) sum += d.held[k] * driven_[i].outboard[k];
      Lambda_[static_cast<size_t>(j) * rows + i] += sum;
    }
  }
}

void PieceClosure::factor(bool with_loads) {
  const double gap = widest_miss(states_, false), slip = widest_miss(states_, true);
  report_ = {};
  report_.open = std::max(gap, slip);
  system_->clear();
  for (size_t m = 0; m < group_.members.size(); ++m) {
    const auto& member = group_.members[m];
    const LoopState& loop = states_[member.loop];
    for (int i = member.row; i < member.row + member.n_rows; ++i) {
      std::copy_n(&Lambda_[static_cast<size_t>(i) * group_.rows], i + 1, system_->row(i));
      system_->row(i)[i] += loop.yields[i - member.row];
    }
    metric_.calc(member.loop, loop, system_->metric(m));
  }
  system_->factor(asked_ ? null_ : null_pivot(gap), with_loads);
  report_.rows = group_.rows - group_.rotors;
  report_.rank = system_->rank() - group_.rotors;
  report_.strong = system_->rank_above(weak_pivot) - group_.rotors;
  report_.smallest_pivot = system_->smallest_pivot();
}

void PieceClosure::solve(std::span<const ClosedPiece> pieces, const Motion<double>& ground,
                         TreeFactor& A, std::span<double> f, bool with_loads) {
  place_forces(pieces, ground, f);
  ask_cuts(pieces, A);
  std::fill(Lambda_.begin(), Lambda_.end(), 0.0);
  for (size_t s = 0; s < pieces.size(); ++s) add_energy(pieces[s], static_cast<int>(s));
  factor(with_loads);
  double asked = 0;
  for (size_t m = 0; m < group_.members.size(); ++m)
    for (int k = 0; k < group_.members[m].n_rows; ++k)
      asked = std::max(asked, size_[group_.members[m].row + k] * system_->scale(m, k));
  phi_ = r_;
  const double missed = system_->solve(phi_);
  if (asked > 0) report_.contradiction = missed / asked;
  std::fill(push_.begin(), push_.end(), 0.0);
  for (int j = 0; j < group_.rows; ++j) {
    const double x = phi_[j], *const F = column(j);
    for (int i = 0; i < n_cut_; ++i) f[i] += x * F[i];
    const double* const w = &w_[push_.size() * j];
    for (size_t k = 0; k < push_.size(); ++k) push_[k] += x * w[k];
  }
}

void PieceClosure::store_loads(double* loads) const {
  for (int l = 0; l < model_.n_loops(); ++l)
    store_loop_load(model_.loops.joints[l], torques_.wrench(states_[l]), loads + 6 * l);
  for (const auto& member : group_.members) {
    Force<double> w = torques_.wrench(states_[member.loop]);
    for (int i = 0; i < member.n_rows; ++i) {
      const Force<double> Q = direction(states_[member.loop].row[i]);
      const double x = phi_[member.row + i];
      w += x * Q;
    }
    store_loop_load(model_.loops.joints[member.loop], w, loads + 6 * member.loop);
  }
}

}  // namespace linkwise
