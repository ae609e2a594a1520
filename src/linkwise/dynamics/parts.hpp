#pragma once
// Many states split into parts, over threads.
#include <algorithm>
#include <functional>

#include "linkwise/exec/executor.hpp"
#include "linkwise/model/model.hpp"
#include "linkwise/simd/lanes.hpp"

namespace linkwise {

/// Asked between parts of the work, from any thread; once it is false, no further part begins.
using GoOn = std::function<bool()>;

/// f(first, n) on parts of `count` states. Parts end at whole lane groups, so that the grouping,
/// and with it every bit, is that of one thread.
template <class F>
void for_each_part(const Model& model, size_t count, const Executor& executor, const GoOn& go_on,
                   F&& f) {
  constexpr size_t most = 1 << 18;  // bodies between two calls of go_on: some 10 ms
  const size_t groups = (count + native_lanes - 1) / native_lanes;
  const size_t work = count * model.n_bodies();
  const size_t shares = std::min(static_cast<size_t>(executor.threads()),
                                 work / static_cast<size_t>(Worth::call) + 1);
  const size_t parts = std::min(groups, std::max(shares, work / most));
  if (parts <= 1) return f(size_t{0}, count);
  executor.for_each(static_cast<int>(parts), [&](int i) {
    if (!go_on()) return;
    const size_t first = groups * i / parts * native_lanes;
    const size_t last = std::min(count, groups * (i + 1) / parts * native_lanes);
    f(first, last - first);
  });
}

}  // namespace linkwise
