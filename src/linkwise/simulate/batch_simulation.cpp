#include "linkwise/simulate/batch_simulation.hpp"

#include <algorithm>

#include "linkwise/base/error.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/simulate/given_motion.hpp"

namespace linkwise {
namespace {

/// `count` members from `first` on.
Start members_of(const Start& all, const Model& m, size_t first, size_t count) {
  return {all.q + first * m.nq(), all.v + first * m.nv(),
          all.tau ? all.tau + first * m.nv() : nullptr, count};
}

/// Members that share SIMD lanes. Closed loops are eliminated in an order that depends on the
/// state, so their members are by themselves.
size_t members_together(const Model& model) { return model.is_constrained() ? 1 : native_lanes; }

/// Wrong starts that show only when loops are closed: of all members the first one is told.
class WrongStarts {
 public:
  explicit WrongStarts(size_t members) : texts_(members) {}
  template <class F>
  bool try_start(size_t member, F&& start) {
    try {
      start();
      return true;
    } catch (const InputError& error) {
      texts_[member] = "member " + std::to_string(member) + ": " + error.what();
      return false;
    }
  }
  void tell() const {
    for (const std::string& text : texts_)
      if (!text.empty()) throw InputError(text);
  }

 private:
  std::vector<std::string> texts_;
};

}  // namespace

std::vector<Ending> simulate_batch(std::span<const Simulation* const> simulations,
                                   const Start& start, std::span<const double> times,
                                   const Sample& samples, const Executor& executor,
                                   const std::function<bool()>& go_on, double* extremes,
                                   MemberNotes* notes) {
  std::vector<Ending> endings(start.members);
  std::vector<double> errors(start.members);
  std::vector<std::string> texts(start.members);
  if (notes) notes->loops.resize(start.members);
  WrongStarts wrong(start.members);
  const size_t per_simulation = start.members / simulations.size();
  for (size_t k = 0; k < simulations.size(); ++k) {
    Setup& setup = *simulations[k]->shared_setup();
    check_members(setup);
    setup.settle();
    for (size_t i = k * per_simulation; i < (k + 1) * per_simulation; ++i) {
      const Start member = members_of(start, *setup.model, i, 1);
      check_quaternions(*setup.model, member.q);
      check_locked_joints(*setup.model, setup.drives, member.v);
    }
  }
  Sample out = samples;
  out.rows = times.size();
  const size_t together = members_together(simulations[0]->model());
  const size_t groups = (per_simulation + together - 1) / together;
  executor.for_each(static_cast<int>(groups * simulations.size()), [&](int task) {
    Simulation group(simulations[task / groups]->shared_setup());
    const Model& m = group.model();
    const size_t begin = task % groups * together;
    const size_t n = std::min(together, per_simulation - begin);
    const size_t first = task / groups * per_simulation + begin;
    group.set_interrupt([&] { return !go_on(); });
    if (extremes) group.keep_extremes(simulations[task / groups]->directions());
    if (!wrong.try_start(first, [&] { group.start(0, members_of(start, m, first, n)); })) return;
    for (size_t k = 0; k < times.size(); ++k) {
      const Sample row = out.at(m, first, k);
      if (group.advance(times[k], row)) continue;
      for (size_t i = 0; i < n; ++i) row.write(m, i, nullptr);
    }
    if (notes) notes->loops[first] = {group.assembled(), group.loop_doubt()};
    for (size_t i = 0; i < n; ++i) {
      endings[first + i] = group.ending(i);
      errors[first + i] = group.force_error(i);
      if (errors[first + i] > 0) texts[first + i] = group.force_doubt(i);
      if (!extremes) continue;
      const std::vector<double> found = group.extremes(i);
      std::copy(found.begin(), found.end(), extremes + (first + i) * found.size());
    }
  });
  wrong.tell();
  if (notes) {
    ForcesOfMembers& forces = notes->forces;
    forces.members = std::count_if(errors.begin(), errors.end(), [](double e) { return e > 0; });
    forces.worst = std::max_element(errors.begin(), errors.end()) - errors.begin();
    if (!errors.empty()) forces.text = texts[forces.worst];
  }
  return endings;
}

}  // namespace linkwise
