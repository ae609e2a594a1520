// Times one forward-dynamics evaluation of a chain, ours with joint loads and Pinocchio's aba, in
// turns within one run, and prints one JSON line a round: {"n", "contestant", "ns_per_body"}.
//     linkwise_evaluate ROUNDS N [N ...]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "chain.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/model/model.hpp"
#ifdef LINKWISE_BENCHMARK_PINOCCHIO
#include "pinocchio_chain.hpp"
#endif

namespace {

using namespace linkwise;

constexpr int n_states = 64;
constexpr double seconds_a_round = 0.05;

Model make_model(const std::vector<ChainLink>& chain) {
  ModelSpec spec;
  spec.links.emplace_back();
  spec.links.back().name = "ground";
  for (size_t i = 0; i < chain.size(); ++i) {
    const ChainLink& from = chain[i];
    LinkSpec link;
    link.name = "link" + std::to_string(i);
    link.mass = from.mass;
    link.com = {from.com[0], from.com[1], from.com[2]};
    link.inertia = {{from.inertia[0], 0, from.inertia[1], 0, 0, from.inertia[2]}};
    JointSpec joint;
    joint.name = "joint" + std::to_string(i);
    joint.parent = spec.links.back().name;
    joint.child = link.name;
    std::copy(from.rotation.begin(), from.rotation.end(), joint.rotation.m);
    joint.translation = {from.translation[0], from.translation[1], from.translation[2]};
    joint.axes = {AxisSpec{}};
    spec.links.push_back(link);
    spec.joints.push_back(joint);
  }
  return Model(spec);
}

/// Something timed: evaluates state k and returns the accelerations.
struct Contestant {
  std::string name;
  std::function<const double*(int k)> evaluate;
};

double seconds(const Contestant& contestant, int calls, int first) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < calls; ++i) contestant.evaluate((first + i) % n_states);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Largest deviation from the first contestant's accelerations, relative to the largest of them.
double disagreement(const std::vector<Contestant>& contestants, int n) {
  double worst = 0;
  for (int k = 0; k < n_states; ++k) {
    const double* first = contestants[0].evaluate(k);
    const std::vector<double> expected(first, first + n);
    double scale = 0;
    for (double x : expected) scale = std::max(scale, std::abs(x));
    for (const Contestant& contestant : contestants) {
      const double* found = contestant.evaluate(k);
      for (int i = 0; i < n; ++i) {
        const double error = std::abs(found[i] - expected[i]) / scale;
        worst = std::isnan(error) ? INFINITY : std::max(worst, error);
      }
    }
  }
  return worst;
}

bool race(int n, int rounds) {
  const std::vector<ChainLink> chain = make_chain(n);
  const States states = make_states(n, n_states);
  const Model model = make_model(chain);
  const auto at = [n](const std::vector<double>& values, int k) {
    return values.data() + static_cast<size_t>(k) * n;
  };
  std::vector<double> acceleration(n), loads(6 * static_cast<size_t>(n));
  std::vector<std::unique_ptr<DynamicsMethod>> methods;
  std::vector<Contestant> contestants;
  for (const char* name : {"articulated_body", "constraint_force"}) {
    DynamicsOptions options;
    options.method = name;
    options.solver = std::string(name) == "constraint_force" ? "thomas" : "auto";
    methods.push_back(make_dynamics(model, options));
    DynamicsMethod* method = methods.back().get();
    contestants.push_back({name, [&, method](int k) {
                             SweepInput<double> in;
                             in.q = at(states.q, k);
                             in.v = at(states.v, k);
                             in.tau = at(states.tau, k);
                             method->evaluate(0, in, acceleration.data(), loads.data());
                             return acceleration.data();
                           }});
  }
#ifdef LINKWISE_BENCHMARK_PINOCCHIO
  PinocchioChain pinocchio(chain);
  for (const bool world : {true, false})
    contestants.push_back({world ? "pinocchio_world" : "pinocchio_local", [&, world](int k) {
                             return pinocchio.aba(at(states.q, k), at(states.v, k),
                                                  at(states.tau, k), world);
                           }});
#endif
  const double error = disagreement(contestants, n);
  if (!(error < 1e-8)) {
    std::fprintf(stderr, "n = %d: the contestants disagree by %.1e; a wrong answer is not timed\n",
                 n, error);
    return false;
  }
  std::vector<int> calls;
  for (const Contestant& contestant : contestants)
    calls.push_back(
        1 + static_cast<int>(seconds_a_round * n_states / seconds(contestant, n_states, 0)));
  for (int round = 0; round < rounds; ++round)
    for (size_t c = 0; c < contestants.size(); ++c) {
      const double time = seconds(contestants[c], calls[c], round);
      std::printf("{\"n\": %d, \"contestant\": \"%s\", \"ns_per_body\": %.4g}\n", n,
                  contestants[c].name.c_str(), 1e9 * time / calls[c] / n);
    }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: linkwise_evaluate ROUNDS N [N ...]\n");
    return 2;
  }
  bool ok = true;
  for (int i = 2; i < argc; ++i) ok = race(std::atoi(argv[i]), std::atoi(argv[1])) && ok;
  return ok ? 0 : 1;
}
