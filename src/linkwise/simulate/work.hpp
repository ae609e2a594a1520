#pragma once
// The works that go into and out of a machine, integrated along the integrator's steps.
#include <functional>
#include <vector>

#include "linkwise/simulate/applied_forces.hpp"

namespace linkwise {

/// Works since the start, per member: of the drives, one per rate, then one per rate of loop
/// joints; then of the external wrenches; then what damping and friction took away. J.
///
/// Powers are evaluated at the Gauss-Legendre nodes of every step, from the dense output. Their
/// quadrature is the work of the step; the polynomial through them gives that until a time within
/// it. So no work depends on the times at which it is asked for. Where the step says nothing about
/// how fast powers change, it is halved until halves add up to the whole.
class WorkIntegral {
 public:
  /// Writes the powers at a time within the last step [members][width], in the order of the works.
  /// False: they are not known there, for what holds a given motion was not found.
  using Powers = std::function<bool(double t, double* powers)>;
  static constexpr int most_nodes = 13;

  static size_t width(const Model& model) {
    return static_cast<size_t>(model.nv()) + model.loops.nv + 2;
  }

  WorkIntegral(const Model& model, size_t members, double t0);

  /// The last step ended at t. nodes: quadrature is exact for powers of degree 2 nodes - 1 in time,
  /// works within the step for those of degree nodes - 1. tolerance: halves of the step agree with
  /// the whole to that share of the largest work, or are halved again; 0: the step stays whole.
  void add_step(double t, int nodes, double tolerance, const Powers& powers);
  /// Works until t within the last step.
  void reach(double t);

  /// False for good after a step in which powers were not known.
  bool known() const { return known_; }
  /// Null where works are not known.
  const double* of(size_t member) const {
    return known_ ? until_.data() + member * width_ : nullptr;
  }

 private:
  /// A part of the last step, with the works at its begin.
  struct Piece {
    double begin, end;
    std::vector<double> powers;  ///< by node
    std::vector<double> at_begin;
  };
  Piece piece(double begin, double end, const Powers& powers);
  void halve(Piece whole, int depth, const Powers& powers);
  bool adds_up(const Piece& whole, const Piece& left, const Piece& right) const;
  void add(const Piece& piece, double fraction, std::vector<double>& works) const;

  size_t width_;
  bool known_ = true;
  double begin_, end_;  ///< of the last step
  int nodes_ = 0;       ///< per piece of it
  double tolerance_ = 0;
  std::vector<Piece> pieces_;           ///< of it, in order
  std::vector<double> at_end_, until_;  ///< works at its end, and at the time asked for last
};

/// The powers of one member whose forces were evaluated, [width].
void write_powers(const Model& model, const AppliedForces& forces, size_t member, const double* q,
                  const double* v, double* powers);

}  // namespace linkwise
