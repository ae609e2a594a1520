#include "linkwise/linear/upper_rows.hpp"

#include <algorithm>

#include "linkwise/simd/lane_memory.hpp"

namespace linkwise {
namespace {

constexpr int width = UpperRows::width;
using Wide = UpperRows::Wide;

/// y[begin, end] -= k x[begin, end], and so behind the end, where x is zero.
LW_INLINE void subtract(double* y, double k, const double* x, int begin, int end) {
  for (int j = begin; j <= end; j += width)
    store_lanes(y + j, load_lanes<Wide>(y + j) - k * load_lanes<Wide>(x + j));
}

}  // namespace

UpperRows::UpperRows(std::span<const int> first, std::span<const int> last)
    : last_(last.begin(), last.end()), inverse_(last.size()) {
  std::ptrdiff_t end = 0;
  for (int i = 0; i < size(); ++i) {
    if (i > 0 && last_[i - 1] >= i) last_[i] = std::max(last_[i], last_[i - 1]);  // fill
    start_.push_back(end - first[i]);
    end += last_[i] - first[i] + 1 + width;
  }
  entries_.resize(static_cast<size_t>(end));
}

void UpperRows::clear() { std::fill(entries_.begin(), entries_.end(), 0.0); }

bool UpperRows::factor(const double* least) {
  for (int k = 0; k < size(); ++k) {
    const double* const own = row(k);
    if (!(own[k] > least[k])) return false;
    inverse_[k] = 1 / own[k];
    for (int i = k + 1; i <= last_[k]; ++i)
      subtract(row(i), own[i] * inverse_[k], own, i, last_[k]);
  }
  return true;
}

void UpperRows::solve(double* x) const {
  for (int k = 0; k < size(); ++k) {
    x[k] *= inverse_[k];
    subtract(x, x[k], row(k), k + 1, last_[k]);
  }
  for (int k = size(); k-- > 0;) {
    const double* const own = row(k);
    Wide sum{};
    for (int j = k + 1; j <= last_[k]; j += width)
      sum += load_lanes<Wide>(own + j) * load_lanes<Wide>(x + j);
    double total = 0;
    for (int l = 0; l < width; ++l) total += sum[l];
    x[k] -= total * inverse_[k];
  }
}

}  // namespace linkwise
