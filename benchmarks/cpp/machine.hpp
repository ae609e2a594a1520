#pragma once
// What every contestant reads: a case folder, written by benchmarks/peers.py.
#include <filesystem>
#include <string>
#include <vector>

struct Body {
  int parent;         // index, -1: ground
  std::string joint;  // revolute, prismatic, floating
  double axis[3];
  double rotation[9];     // joint axes in the parent frame, row-major
  double translation[3];  // m
  double mass;            // kg
  double com[3];          // m
  double inertia[6];      // about the centre of mass, joint axes: xx xy xz yy yz zz, kg m^2
};

struct Machine {
  double gravity[3];
  std::vector<Body> bodies;
};

Machine read_machine(const std::filesystem::path& folder);

/// States that the timed calls cycle through: no call repeats the previous one's sines.
struct States {
  int count = 0, nq = 0, nv = 0;
  std::vector<double> q, v, tau;  // [count][nq], [count][nv], [count][nv]
  const double* q_at(int k) const { return q.data() + static_cast<size_t>(k) * nq; }
  const double* v_at(int k) const { return v.data() + static_cast<size_t>(k) * nv; }
  const double* tau_at(int k) const { return tau.data() + static_cast<size_t>(k) * nv; }
};

/// In the coordinates of one engine.
States read_states(const std::filesystem::path& folder, const std::string& engine);

std::string read_bytes(const std::filesystem::path& file);
