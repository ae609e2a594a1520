#pragma once
// A long loop split into tiles, the unit that threads share. Where a tile ends depends on the
// length of the loop alone. So sums over tiles have the same bits for any number of threads.
#include <algorithm>

#include "linkwise/exec/executor.hpp"

namespace linkwise {

/// The shortest tile: several microseconds of work, a barrier costing about one.
enum class TileOf { nodes = 1024, entries = 8192 };
inline constexpr int max_tiles = 256;

struct Tiles {
  Tiles(int items, TileOf what)
      : n(items),
        length(std::max(static_cast<int>(what), (n + max_tiles - 1) / max_tiles)),
        count((n + length - 1) / length) {}
  int n, length, count;

  /// f(tile, begin, end) for every tile.
  template <class F>
  void for_each(const Executor& executor, F&& f) const {
    const auto task = [&](int t) { f(t, t * length, std::min(n, (t + 1) * length)); };
    if (count == 1)
      task(0);
    else
      executor.for_each(count, task);
  }

  /// The sum of f(begin, end) over the tiles, in their order.
  template <class F>
  double sum(const Executor& executor, F&& f) const {
    double part[max_tiles];
    for_each(executor, [&](int t, int begin, int end) { part[t] = f(begin, end); });
    double total = 0.0;
    for (int t = 0; t < count; ++t) total += part[t];
    return total;
  }
};

}  // namespace linkwise
