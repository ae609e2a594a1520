// Where one system is better cut: the numbers behind method "auto" and paths_fill.
//
//     cmake --preset release -DLINKWISE_BUILD_BENCHMARKS=ON
//     cmake --build --preset release --target linkwise_crossovers
//     build/release/benchmarks/cpp/linkwise_crossovers
//
// Chains of random hinges by the recursion body by body and in pieces; trees body by body and with
// their paths in SIMD lanes. Nanoseconds per body, joint loads included, one thread, best of many.

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "linkwise/dynamics/articulated_body.hpp"
#include "linkwise/dynamics/articulated_paths.hpp"
#include "linkwise/dynamics/piecewise.hpp"
#include "timing.hpp"

using namespace linkwise;

namespace {

constexpr int n_states = 16;
constexpr int repeats = 40;
std::mt19937 random_bits(1);

double draw() { return std::normal_distribution<double>()(random_bits); }

/// Revolute links; parent -1 is the ground or a floating base.
Model machine(const std::vector<int>& parents, bool floating_base) {
  ModelSpec spec;
  spec.gravity = {0, 0, -9.81};
  spec.links.emplace_back().name = "ground";
  const auto add = [&](const std::string& name, const std::string& parent) {
    LinkSpec link;
    link.name = name;
    link.mass = 1;
    link.com = {0.1, 0, -0.5};
    link.inertia = {{0.4, 0, 0.4, 0, 0, 0.1}};
    spec.links.push_back(link);
    JointSpec joint;
    joint.name = "to_" + name;
    joint.parent = parent;
    joint.child = name;
    spec.joints.push_back(joint);
  };
  if (floating_base) {
    add("base", "ground");
    spec.joints.back().type = JointType::floating;
  }
  for (size_t i = 0; i < parents.size(); ++i) {
    const int parent = parents[i];
    add("link" + std::to_string(i), parent >= 0     ? "link" + std::to_string(parent)
                                    : floating_base ? "base"
                                                    : "ground");
    spec.joints.back().translation = {0.3, 0.1 * (i % 4), i > 0 ? -1.0 : 0.0};
    spec.joints.back().axes = {{AxisKind::revolute, {draw(), draw(), draw()}, 0}};
  }
  return Model(spec);
}

/// evaluate(input, du, loads), ns per body.
template <class Evaluate>
double nanoseconds(const Model& model, Evaluate&& evaluate) {
  const size_t nq = model.nq(), nv = model.nv();
  std::vector<double> q(n_states * nq), v(n_states * nv), tau(n_states * nv), du(nv),
      loads(6 * model.n_joints());
  for (auto* values : {&q, &v, &tau})
    for (double& x : *values) x = draw();
  const int calls = std::max(4, 20'000 / model.n_bodies());
  double best = 1e300;
  for (int turn = 0; turn < repeats; ++turn) {
    const Taken taken = timed(calls, [&](long i) {
      const size_t k = i % n_states;
      SweepInput<double> in;
      in.q = &q[k * nq];
      in.v = &v[k * nv];
      in.tau = &tau[k * nv];
      evaluate(in, du.data(), loads.data());
    });
    best = std::min(best, 1e9 * taken.seconds / calls / model.n_bodies());
  }
  return best;
}

double body_by_body(const Model& model) {
  ArticulatedBody<double> method(model);
  return nanoseconds(
      model, [&](const auto& in, double* du, double* loads) { method.evaluate(in, du, loads); });
}

std::vector<int> legs(int count, int length) {
  std::vector<int> parents;
  for (int leg = 0; leg < count; ++leg)
    for (int k = 0; k < length; ++k)
      parents.push_back(k == 0 ? -1 : static_cast<int>(parents.size()) - 1);
  return parents;
}
/// Each body on one of the `reach` before it.
std::vector<int> grown(int n, int reach) {
  std::vector<int> parents(n);
  for (int i = 0; i < n; ++i)
    parents[i] = i == 0 ? -1 : i - 1 - static_cast<int>(random_bits() % std::min(i, reach));
  return parents;
}

void print_chain(int n) {
  const Model model = machine(legs(1, n), false);
  DynamicsOptions options;
  Piecewise pieces(model, options);
  const double in_pieces = nanoseconds(
      model, [&](const auto& in, double* du, double* loads) { pieces.evaluate(0, in, du, loads); });
  options.method = "auto";
  std::printf("| %d | %.0f | %.0f | %s |\n", n, body_by_body(model), in_pieces,
              choose_dynamics(model, options).method.c_str());
}

void print_tree(const char* name, const std::vector<int>& parents, bool floating_base = false) {
  using Group = Lanes<native_lanes>;
  const Model model = machine(parents, floating_base);
  const Paths paths(model);
  ArticulatedPaths<Group> method(model);
  const double side_by_side = nanoseconds(
      model, [&](const auto& in, double* du, double* loads) { method.evaluate(in, du, loads); });
  std::printf("| %s | %d | %zu | %d | %.0f | %.0f | %s |\n", name, model.n_bodies(),
              paths.path.size(), paths.positions(native_lanes), body_by_body(model), side_by_side,
              paths_fill(model, native_lanes) ? "paths" : "bodies");
}

}  // namespace

int main() {
  std::printf("%d lanes, ns per body\n\n| chain of | body by body | piecewise | auto |\n",
              native_lanes);
  std::printf("|---:|---:|---:|---|\n");
  for (const int n : {16, 32, 48, 64, 96, 128, 300, 1000}) print_chain(n);
  std::printf("\n| tree | bodies | paths | positions | body by body | paths in lanes | chosen |\n");
  std::printf("|---|---:|---:|---:|---:|---:|---|\n");
  print_tree("four legs of 3 on a floating base", legs(4, 3), true);
  print_tree("six legs of 3 on a floating base", legs(6, 3), true);
  print_tree("two arms of 7", legs(2, 7));
  print_tree("five fingers of 4", legs(5, 4));
  print_tree("four arms of 250", legs(4, 250));
  print_tree("a chain of 30", legs(1, 30));
  for (const int n : {30, 100, 1000, 10'000}) {
    print_tree("grown anywhere", grown(n, n));
    print_tree("grown near the tips", grown(n, 4));
  }
}
