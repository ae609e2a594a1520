// Torques of driven joints of machines with loops: forward and back, and what is refused.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/driven_inverse.hpp"

namespace linkwise::testing {
namespace {

using Names = std::vector<std::string>;

struct Motion {
  std::vector<double> tau, a, loads;
};

/// What torques at some degrees of freedom do, by the forward dynamics.
Motion moved_by(const LoopedMachine& machine, std::span<const int> dofs, Draws& draws) {
  Motion motion{std::vector<double>(machine.model.nv()), std::vector<double>(machine.model.nv()),
                std::vector<double>(6 * static_cast<size_t>(machine.model.n_loads()))};
  for (const int i : dofs) motion.tau[i] = draws.uniform(-5, 5);
  SweepInput<double> in = machine.input();
  in.tau = motion.tau.data();
  EXPECT_TRUE(
      make_dynamics(machine.model, {})->evaluate(0, in, motion.a.data(), motion.loads.data()).ok());
  return motion;
}

Motion driven_by(const LoopedMachine& machine, const Names& driven, const std::vector<double>& a) {
  const std::vector<double> none(machine.model.nv());
  SweepInput<double> in = machine.input();
  in.tau = none.data();
  Motion motion{std::vector<double>(machine.model.nv()), a,
                std::vector<double>(6 * static_cast<size_t>(machine.model.n_loads()))};
  DrivenInverse inverse(machine.model, driven);
  EXPECT_TRUE(
      inverse.evaluate(in, a.data(), "", {motion.tau.data(), nullptr, motion.loads.data()}).ok());
  return motion;
}

void expect_same(const Motion& got, const Motion& want) {
  double size = 1;
  for (const double x : want.loads) size = std::max(size, std::abs(x));
  for (size_t i = 0; i < want.tau.size(); ++i) EXPECT_NEAR(got.tau[i], want.tau[i], 1e-9 * size);
  for (size_t i = 0; i < want.loads.size(); ++i)
    EXPECT_NEAR(got.loads[i], want.loads[i], 1e-9 * size) << "load " << i;
}

TEST(DrivenInverse, GivesTheTorquesOfRowsOfFourBarsBack) {
  Draws draws(3);
  for (const int n : {1, 3, 20}) {
    LoopedMachine machine(row_of_four_bars(n));
    machine.make_consistent();
    const std::vector<int> dofs{machine.model.joints[machine.model.joint_index("pin0")].v};
    const Motion want = moved_by(machine, dofs, draws);
    expect_same(driven_by(machine, {"pin0"}, want.a), want);
  }
}

TEST(DrivenInverse, TakesCouplingsAndSaysWhatItRefuses) {
  Draws draws(5);
  using enum JointType;
  LoopedMachine machine(tree_spec({revolute, prismatic, revolute}, {-1, 0, 1}, draws), draws);
  machine.couple(2, draws);
  machine.make_consistent();
  const auto& terms = machine.model.couplings[0].terms;
  const auto name = [&](int j) { return machine.model.joints[j].name; };
  const int free = 3 - terms[0].joint - terms[1].joint;
  const Names driven{name(terms[0].joint), name(free)};
  const std::vector<int> dofs{terms[0].v, machine.model.joints[free].v};
  const Motion want = moved_by(machine, dofs, draws);
  expect_same(driven_by(machine, driven, want.a), want);

  const Names coupled{name(terms[0].joint), name(terms[1].joint)};
  EXPECT_THROW(driven_by(machine, coupled, want.a), InputError);
  EXPECT_THROW(driven_by(machine, {driven[0]}, want.a), InputError);
  EXPECT_THROW(driven_by(machine, {}, want.a), InputError);
  EXPECT_THROW(driven_by(machine, {driven[0], driven[0]}, want.a), InputError);
  std::vector<double> opening = want.a;
  opening[terms[0].v] += 0.1;
  EXPECT_THROW(driven_by(machine, driven, opening), InputError);
}

}  // namespace
}  // namespace linkwise::testing
