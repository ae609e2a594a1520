#pragma once
// Many simulations of fixed step at once: members of one model share a group of SIMD lanes and an
// integrator, groups are dealt out over threads. Grouping depends on the number of members alone,
// and groups share nothing, so the number of threads does not change a bit.
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "linkwise/exec/executor.hpp"
#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

/// Members whose forces of large gain are not known well.
struct ForcesOfMembers {
  size_t members = 0, worst = 0;
  std::string text;  ///< Simulation::force_doubt() of the worst
};

/// What is said of the closed loops of a member: see Simulation.
struct LoopNotes {
  std::string assembled, doubt;
};

/// What is said beside the endings.
struct MemberNotes {
  ForcesOfMembers forces;
  std::vector<LoopNotes> loops;  ///< of each member
};

/// Simulates from time 0 on. Model, drives, wrenches and numerics are those of the simulations,
/// which check_members() must take and which share the members of the start equally. Arrays of
/// `samples` are [member][time][...], NaN after a member's end: a member that fails ends alone.
/// extremes: of each member, rows of Extremes::size(); null: not kept, which is up to the
/// simulations. `go_on` is asked at every step, from any thread; once it is false, members under
/// way end as `interrupted`. notes: null: not asked for. InputError, naming the first member whose
/// loops cannot be closed, once the others have ended.
std::vector<Ending> simulate_batch(std::span<const Simulation* const> simulations,
                                   const Start& start, std::span<const double> times,
                                   const Sample& samples, const Executor& executor,
                                   const std::function<bool()>& go_on, double* extremes = nullptr,
                                   MemberNotes* notes = nullptr);

}  // namespace linkwise
