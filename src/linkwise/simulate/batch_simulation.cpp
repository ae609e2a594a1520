#include "linkwise/simulate/batch_simulation.hpp"

#include <algorithm>

#include "linkwise/base/error.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {
namespace {

/// Members from `first` on.
Start from_member(const Start& start, const Model& m, size_t first) {
  return {start.q + first * m.nq(), start.v + first * m.nv(),
          start.tau ? start.tau + first * m.nv() : nullptr};
}

}  // namespace

void check_members(const Setup& setup) {
  const std::string& integrator = setup.options.integrator;
  if (!find_integrator(integrator).fixed_step)
    throw InputError("integrator '" + integrator + "' chooses its own steps; a batch takes " +
                     fixed_step_names());
  for (size_t j = 0; j < setup.drives.size(); ++j)
    if (setup.drives[j].callable || setup.drives[j].motion)
      throw InputError("drives['" + setup.model->joints[j].name +
                       "'] is a function; a batch takes numbers and tables");
  for (const Wrench& wrench : setup.wrenches)
    if (wrench.callable)
      throw InputError("wrenches: a function is given; a batch takes numbers and tables");
}

std::vector<Ending> simulate_batch(std::span<const Simulation* const> simulations,
                                   size_t per_simulation, const Start& start,
                                   std::span<const double> times, const Sample& samples,
                                   const Executor& executor, const std::function<bool()>& go_on) {
  std::vector<Ending> endings(simulations.size() * per_simulation);
  for (size_t k = 0; k < simulations.size(); ++k) {
    Setup& setup = *simulations[k]->shared_setup();
    check_members(setup);
    setup.settle();
    for (size_t i = k * per_simulation; i < (k + 1) * per_simulation; ++i) {
      const Start member = from_member(start, *setup.model, i);
      check_quaternions(*setup.model, member.q);
      check_locked_joints(*setup.model, setup.drives, member.v);
    }
  }
  Sample out = samples;
  out.rows = times.size();
  const size_t groups = (per_simulation + native_lanes - 1) / native_lanes;
  executor.for_each(static_cast<int>(groups * simulations.size()), [&](int task) {
    Simulation group(simulations[task / groups]->shared_setup());
    const Model& m = group.model();
    const size_t begin = task % groups * native_lanes;
    const size_t n = std::min<size_t>(native_lanes, per_simulation - begin);
    const size_t first = task / groups * per_simulation + begin;
    group.set_interrupt([&] { return !go_on(); });
    group.start_members(0, n, from_member(start, m, first));
    for (size_t k = 0; k < times.size(); ++k) {
      const Sample row = out.at(m, first, k);
      if (group.advance(times[k], row)) continue;
      for (size_t i = 0; i < n; ++i) row.write(m, i, nullptr);
    }
    for (size_t i = 0; i < n; ++i) endings[first + i] = group.ending(i);
  });
  return endings;
}

}  // namespace linkwise
