#pragma once
// Closes the loops of a state that is off them by the error of a step: positions first, by Newton's
// method with the least change in the metric of the mass matrix, then rates with the least change
// of kinetic energy,
//     q <- q (+) -H^-1 K^T (K H^-1 K^T)^+ g,     u <- u - H^-1 K^T (K H^-1 K^T)^+ (K u - k_t) .
// Each is one response of the machine at rest. What given motions ask for is in g and in the slip
// K u - k_t of the loop joints already, since these are taken with all rates.
#include <algorithm>
#include <memory>
#include <vector>

#include "linkwise/base/outcome.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/dynamics/looped_constraint_force.hpp"
#include "linkwise/dynamics/piecewise.hpp"

namespace linkwise {

/// Coordinates [nq] and rates [nv] of loop joints, as of SweepInput.
struct LoopMotion {
  const double *q = nullptr, *v = nullptr;
};

class LoopProjection {
 public:
  /// The model must outlive it; prescribed joints stay where they are. by_graph: by the forces of
  /// all joints at once, which holds weak directions like all others.
  explicit LoopProjection(const Model& model, bool by_graph = false);

  /// From now on, what loop joints of given motion are to follow.
  void give(const LoopMotion& given) { given_ = given; }

  /// Looks how many directions the loops hold at q, which closes them, and at positions beside it,
  /// those to which rates v lead among them (null: none). The most of them is what they hold
  /// anywhere but in singular positions.
  void find_rank(const double* q, const double* v = nullptr);
  int full_rank() const { return full_; }
  /// How many directions more are held there by next to nothing, and how much of the strongest that
  /// is: axes that are parallel but for the digits that a file has, or masses that are very unlike.
  int n_faint() const { return n_faint_; }
  double faintest() const { return faintest_pivot_; }
  /// How many of them are lost at q itself, where the machine may move on in several ways. Of a
  /// long row of loops some may be missed.
  int lost_at_start() const { return std::max(0, full_ - at_start_); }

  /// q [nq], v [nv]; v may be null. Any outcome but `converged` leaves both as they were. closely:
  /// weak directions are closed, too, however little they are open.
  Outcome project(double* q, double* v, bool closely = false);

  /// How far the loops are open at q: shifts over the loop's length, and turns, root of the sum of
  /// squares.
  double gap(const double* q);
  /// One step of Newton's method from where gap() was asked: the change of rates du [nv].
  bool close(const double* q, double least, double* du);
  /// Takes out of v what opens the loops; returns by how much it did, as gap(), per second.
  double stop(const double* q, double least, double* v);
  /// The same as it is, without a change.
  double slip(const double* q, const double* v);

  const LoopStates& states() const { return *at_; }
  const LoopReport& report() const {
    return graph_ ? graph_->report() : pieces_ ? pieces_->loop_report() : recursion_->report();
  }

 private:
  double miss(const double* q, const double* v);
  LoopReport report_at(const double* q);
  bool respond(const double* q, double least, double* du);
  double least_to_close(int stage, double open) const;

  void find_states(const double* q, const double* v);

  const Model& model_;
  LoopMotion given_;
  LoopStates states_;
  const LoopStates* at_ = &states_;              ///< of the last state: these or the pieces'
  std::unique_ptr<ArticulatedLoops> recursion_;  ///< or
  std::unique_ptr<Piecewise> pieces_;            ///< of a long chain, or
  std::unique_ptr<LoopedConstraintForce> graph_;
  std::vector<double> asked_;
  int full_ = 0, at_start_ = 0, n_faint_ = 0;
  double faintest_pivot_ = 1;
  double weakest_;   ///< directions that hold less are left alone
  double faintest_;  ///< and below this, as long as they are hardly open
  std::vector<double> du_, q_, v_;
};

/// q moves by rates du [nv] for a unit of time, along the straight line of its coordinates;
/// quaternions are put back to unit length.
void move_by(const Model& model, const double* du, double* q);

}  // namespace linkwise
