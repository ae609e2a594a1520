#include <gtest/gtest.h>

#include "kinematics/world_twin.hpp"
#include "linkwise/kinematics/body_state.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

class BodyStates : public ::testing::TestWithParam<Machine> {};

struct Swept {
  std::vector<BodyState<double>> states;
  std::vector<GeneralState<double>> general;
};
Swept sweep(const Model& model, const SweepInput<double>& in) {
  Swept out{std::vector<BodyState<double>>(model.n_bodies()),
            std::vector<GeneralState<double>>(model.n_general)};
  calc_body_states(model, in, out.states.data(), out.general.data());
  return out;
}

/// The frame's velocity in its own axes, of a world screw.
template <class T>
Vector6<T> in_frame(const Pose<T>& at, const Screw<T>& v) {
  return to_array(
      Motion<T>{transpose_times(at.R, v.s + cross(v.w, at.p)), transpose_times(at.R, v.w)});
}

void expect_near(const Vector6<double>& got, const Vector6<double>& want, const char* what,
                 int body) {
  double scale = 1;
  for (double x : want) scale = std::max(scale, std::abs(x));
  for (int i = 0; i < 6; ++i)
    EXPECT_NEAR(got[i], want[i], 1e-12 * scale) << what << " of body " << body << " [" << i << "]";
}

// v_n = X v_p + P u and a_n = X a_p + P du + c, component by component, against positions that are
// differentiated numerically: a_n is the rate of v_n's components.
TEST_P(BodyStates, VelocitiesAndAccelerationsAreRatesOfThePoses) {
  const Model model(GetParam().spec);
  const WorldTwin twin(model);
  Draws draws(3);
  const MachineState state = random_state(model, draws);
  const std::vector<double> du = random_values(model.nv(), draws);
  const auto moved = twin.moved(state.q, state.v, du);

  SweepInput<double> in;
  in.q = state.q.data();
  in.v = state.v.data();
  in.prescribed = du.data();
  const Swept swept = sweep(model, in);
  std::vector<Motion<double>> a(model.n_bodies());
  for (const JointInfo& joint : model.joints) {
    if (!joint.last_of_body) continue;
    const int n = joint.body;
    const BodyTopology& body = model.topology[n];
    if (body.parent >= 0) a[n] = swept.states[n].X * a[body.parent];
    a[n] += swept.states[n].c;
    const auto accelerate = [&](const Motion<double>& P, double rate) { a[n] += rate * P; };
    if (body.joint_kind == JointKind::general) {
      const auto& g = swept.general[body.general];
      for (int i = 0; i < g.n; ++i) accelerate(g.P[i], du[g.dof[i]]);
    } else {
      accelerate(element_column<double>(model.elements[body.first_element], 0), du[body.v]);
    }
    const auto want = in_frame(moved.pose[joint.link], moved.velocity[joint.link]);
    Vector6<double> want_v, want_a;
    for (int i = 0; i < 6; ++i) {
      want_v[i] = want[i].real();
      want_a[i] = want[i].imag() / WorldTwin::step;
    }
    const Motion<double>& v = swept.states[n].v;
    expect_near(to_array(joint.to_user * v), want_v, "velocity", n);
    expect_near(to_array(joint.to_user * a[n]), want_a, "acceleration", n);
  }
}

TEST_P(BodyStates, LanesEqualScalars) {
  const Model model(GetParam().spec);
  Draws draws(4);
  constexpr int W = native_lanes;
  using S = Lanes<W>;
  std::vector<S> q(model.nq()), v(model.nv());
  MachineState one[W];
  for (int l = 0; l < W; ++l) {
    one[l] = random_state(model, draws);
    for (size_t i = 0; i < q.size(); ++i) set_lane(q[i], l, one[l].q[i]);
    for (size_t i = 0; i < v.size(); ++i) set_lane(v[i], l, one[l].v[i]);
  }
  SweepInput<S> in;
  in.q = q.data();
  in.v = v.data();
  std::vector<BodyState<S>> states(model.n_bodies());
  std::vector<GeneralState<S>> general(model.n_general);
  calc_body_states(model, in, states.data(), general.data());
  for (int l = 0; l < W; ++l) {
    SweepInput<double> single;
    single.q = one[l].q.data();
    single.v = one[l].v.data();
    const Swept swept = sweep(model, single);
    for (int n = 0; n < model.n_bodies(); ++n) {
      const auto lane_of = [&](const auto& six) {
        const auto all = to_array(six);
        Vector6<double> out;
        for (int i = 0; i < 6; ++i) out[i] = lane(all[i], l);
        return out;
      };
      expect_near(lane_of(states[n].v), to_array(swept.states[n].v), "velocity", n);
      expect_near(lane_of(states[n].c), to_array(swept.states[n].c), "c", n);
      expect_near(lane_of(states[n].bias), to_array(swept.states[n].bias), "bias", n);
    }
  }
}

TEST_P(BodyStates, WithoutRatesIsAtRest) {
  const Model model(GetParam().spec);
  Draws draws(5);
  const MachineState state = random_state(model, draws);
  const std::vector<double> zero(model.nv());
  SweepInput<double> in;
  in.q = state.q.data();
  const Swept none = sweep(model, in);
  in.v = zero.data();
  const Swept rest = sweep(model, in);
  for (int n = 0; n < model.n_bodies(); ++n) {
    EXPECT_EQ(to_array(none.states[n].v), to_array(rest.states[n].v));
    EXPECT_EQ(to_array(none.states[n].c), to_array(rest.states[n].c));
    EXPECT_EQ(to_array(none.states[n].bias), Vector6<double>{});
  }
}

INSTANTIATE_TEST_SUITE_P(Machines, BodyStates, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace linkwise::testing
