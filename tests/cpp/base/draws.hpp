#pragma once
// Random numbers that are the same on every machine and every run.

#include <cmath>
#include <cstdint>
#include <numbers>

namespace linkwise::testing {

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : state_(seed) {}

  /// SplitMix64.
  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(bits() >> 11) * 0x1p-53;
  }
  double normal() {
    return std::sqrt(-2 * std::log(uniform(1e-12, 1))) *
           std::cos(2 * std::numbers::pi * uniform(0, 1));
  }
  int below(int n) { return static_cast<int>(bits() % static_cast<std::uint64_t>(n)); }

 private:
  std::uint64_t state_;
};

}  // namespace linkwise::testing
