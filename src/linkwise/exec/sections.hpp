#pragma once
// Long loops cut into sections, the unit that threads share. Where the cuts are depends on the
// length of the loop alone, never on the threads, so that sums over sections have the same bits for
// any number of them.
#include <algorithm>
#include <functional>

#include "linkwise/exec/thread_pool.hpp"

namespace linkwise {

/// Several microseconds of work, a barrier costing about one.
enum class SectionOf { nodes = 1024, entries = 8192 };
inline constexpr int max_sections = 256;

struct Sections {
  Sections(int items, SectionOf what)
      : n(items),
        length(std::max(static_cast<int>(what), (n + max_sections - 1) / max_sections)),
        count((n + length - 1) / length) {}
  int n, length, count;

  /// f(section, begin, end) for every section, on up to `threads` threads.
  template <class F>
  void for_each(int threads, F&& f) const {
    const auto task = [&](int s) { f(s, s * length, std::min(n, (s + 1) * length)); };
    if (count == 1)
      task(0);
    else
      parallel_for(count, threads, std::ref(task));  // by reference: nothing is allocated
  }

  /// The sum of f(begin, end) over the sections, in their order.
  template <class F>
  double sum(int threads, F&& f) const {
    double part[max_sections];
    for_each(threads, [&](int s, int begin, int end) { part[s] = f(begin, end); });
    double total = 0.0;
    for (int s = 0; s < count; ++s) total += part[s];
    return total;
  }
};

}  // namespace linkwise
