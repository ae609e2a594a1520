// What is timed as the serial part of an evaluation does the work that it stands for.
#include <gtest/gtest.h>

#include "linkwise/paper/serial_part.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

TEST(SerialPart, PassesTheVelocitiesOfTheBodies) {
  Draws draws(7);
  const Model model(
      tree_spec(std::vector(9, JointType::revolute), {-1, 0, 1, 1, 3, 4, 0, 6, 7}, draws));
  const std::vector<double> q = random_values(model.nq(), draws),
                            v = random_values(model.nv(), draws);
  SweepInput<double> in;
  in.q = q.data();
  in.v = v.data();
  std::vector<BodyState<double>> state(model.n_bodies());
  std::vector<GeneralState<double>> general(model.n_general);
  calc_body_states(model, in, state.data(), general.data());
  SerialPart part(model, q.data(), v.data());
  part.pass_velocities();
  ASSERT_EQ(part.velocities().size(), state.size());
  for (size_t i = 0; i < state.size(); ++i) {
    const auto got = to_array(part.velocities()[i]), want = to_array(state[i].v);
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(got[k], want[k], 1e-13) << i;
  }
}

TEST(SerialPart, AddsOneNumberPerBody) {
  Draws draws(8);
  const Model model(tree_spec(std::vector(4, JointType::revolute), {-1, 0, 1, 2}, draws));
  const std::vector<double> rest(model.nv());
  SerialPart part(model, rest.data(), rest.data());
  part.add(0);
  EXPECT_EQ(part.sum(), 0);
  part.add(3);
  EXPECT_NEAR(part.sum(), 25.0 / 12, 1e-15);
}

}  // namespace
}  // namespace linkwise::testing
