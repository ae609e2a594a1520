#pragma once
// Assembles a machine whose loops are open: the position nearby that closes them, and rates that
// keep them closed.
#include <string>
#include <vector>

#include "linkwise/dynamics/loop_projection.hpp"

namespace linkwise {

/// The rates that a joint which closes loops is to have, one per degree of freedom.
struct LoopRate {
  std::string joint;
  std::vector<double> v;
};

struct Assembly {
  std::vector<double> q, v;
  double gap = 0;                     ///< what was open before: see LoopProjection::gap
  std::vector<std::string> released;  ///< of those to be held, in the order given
  std::vector<std::string> moved;     ///< joints, with how much, one line each
};

/// Newton's method from q [nq] on, each step of which takes the least change in the metric of the
/// mass matrix; then rates of least change of kinetic energy from v [nv], empty: at rest. Joints of
/// given motion and those in `hold` stay where they are, those that close loops where `given` says;
/// where loops do not close so, those of `hold` are released, the last one first. InputError where
/// no position is found, with the loop and what is left open, and where rates that are given
/// contradict each other. `rates` are conditions on those of the tree. With them a joint of `hold`
/// keeps its own where they and the joints held before it allow that.
Assembly assemble(const Model& model, std::vector<double> q, std::vector<double> v,
                  const std::vector<std::string>& hold, const LoopMotion& given = {},
                  const std::vector<LoopRate>& rates = {});

/// "'a' is 1.64 instead of 1, ...", of every joint whose rates got changed by more than rounding;
/// of its degrees of freedom the one that changed most. `moving`: of joints asked to move alone.
std::string changed_rates(const Model& model, const double* asked, const double* got,
                          bool moving = false);

/// InputError naming the loop where q and v leave one open.
void require_assembled(const Model& model, const std::vector<double>& q,
                       const std::vector<double>& v, const LoopMotion& given = {});

/// Whether a machine can go on from q, which closes its loops, by rates [nv] that open none at
/// first; null: by any such rates. A triangle that is folded flat cannot: its loops hold it there,
/// but by no finite force.
bool can_go_on(const Model& model, LoopProjection& loops, const double* q,
               const double* rates = nullptr);

/// "motions of 'a' and 'c' contradict each other through the loop that joint 'x' closes", of the
/// loop that is open the widest among those with joints of given motion; empty: there is none.
std::string contradicting_motions(const Model& model, const LoopStates& states);

}  // namespace linkwise
