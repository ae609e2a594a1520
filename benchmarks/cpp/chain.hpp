#pragma once
// The chain that every contestant builds: revolute joints about z with random placements, so the
// axes change from joint to joint and the motion is spatial.
#include <array>
#include <vector>

struct ChainLink {
  std::array<double, 9> rotation;     // joint axes in the parent frame, row-major, columns are axes
  std::array<double, 3> translation;  // m
  double mass;                        // kg
  std::array<double, 3> com;          // m
  std::array<double, 3> inertia;      // principal, about the centre of mass, link axes, kg m^2
};

std::vector<ChainLink> make_chain(int n);

/// States that the timed calls cycle through: no call repeats the previous one's sines.
struct States {
  int n, count;
  std::vector<double> q, v, tau;  // [count][n]
};
States make_states(int n, int count);
