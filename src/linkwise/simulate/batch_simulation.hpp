#pragma once
// Many simulations of fixed step at once: members of one model share a group of SIMD lanes and an
// integrator, groups are dealt out over threads. Grouping depends on the number of members alone,
// and groups share nothing, so the number of threads does not change a bit.
#include <functional>
#include <span>
#include <vector>

#include "linkwise/exec/executor.hpp"
#include "linkwise/simulate/simulation.hpp"

namespace linkwise {

/// InputError where a setup has what members cannot share: an integrator that chooses its steps,
/// functions of Python as drives.
void check_members(const Setup& setup);

/// Simulates from time 0 on. Model, drives, wrenches and integrator are those of the simulations,
/// each of which has `per_simulation` members; the method is articulated_body. Arrays of `samples`
/// are [member][time][...], NaN after a member's end: a member that fails ends alone. `go_on` is
/// asked at every step, from any thread; once it is false, members under way end as `interrupted`.
std::vector<Ending> simulate_batch(std::span<const Simulation* const> simulations,
                                   size_t per_simulation, const Start& start,
                                   std::span<const double> times, const Sample& samples,
                                   const Executor& executor, const std::function<bool()>& go_on);

}  // namespace linkwise
