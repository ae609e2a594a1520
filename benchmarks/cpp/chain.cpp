#include "chain.hpp"

#include <cmath>
#include <random>

std::vector<ChainLink> make_chain(int n) {
  std::mt19937 generator(1993);
  std::normal_distribution<double> normal;
  const double length = 1, radius = 0.05, mass = 1;
  const double across = mass * (3 * radius * radius + length * length) / 12;
  std::vector<ChainLink> chain(n);
  for (int i = 0; i < n; ++i) {
    double w = normal(generator), x = normal(generator), y = normal(generator),
           z = normal(generator);
    const double s = 1 / std::sqrt(w * w + x * x + y * y + z * z);
    w *= s, x *= s, y *= s, z *= s;
    chain[i].rotation = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                         2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                         2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
    chain[i].translation =
        i > 0 ? std::array{0.3 * length, 0.0, -length} : std::array{0.0, 0.0, 0.0};
    chain[i].mass = mass;
    chain[i].com = {0.1, 0, -length / 2};
    chain[i].inertia = {across, across, mass * radius * radius / 2};
  }
  return chain;
}

States make_states(int n, int count) {
  std::mt19937 generator(735);
  std::uniform_real_distribution<double> uniform(-1, 1);
  States states{n, count, {}, {}, {}};
  for (auto* values : {&states.q, &states.v, &states.tau}) {
    values->resize(static_cast<size_t>(n) * count);
    for (double& x : *values) x = uniform(generator);
  }
  return states;
}
