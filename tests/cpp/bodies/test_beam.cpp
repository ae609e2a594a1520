// A beam's blocks against a row of many points that its field carries, and its modes against those
// of textbooks.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/bodies/body_kinds.hpp"

namespace linkwise::testing {
namespace {

BeamProperties properties(int interior_modes, bool stretches) {
  BeamProperties of{};
  of.length = 1.5;
  of.mass_per_length = 2;
  of.EA = 3e5;
  of.EIy = 200;
  of.EIz = 120;
  of.GJ = 90;
  of.rotary_y = 0.004;
  of.rotary_z = 0.003;
  of.damping_ratio = 0.01;
  of.interior_modes = interior_modes;
  of.stretches = stretches;
  const double axes[] = {0.6, -0.8, 0, 0.8, 0.6, 0, 0, 0, 1};
  std::copy(axes, axes + 9, of.axes);
  of.start[0] = 0.1;
  of.start[1] = -0.2;
  of.start[2] = 0.3;
  return of;
}

Beam make(const BeamProperties& of) {
  const auto* first = reinterpret_cast<const double*>(&of);
  return Beam::make({}, {first, static_cast<size_t>(Beam::n_parameters)});
}

struct State {
  std::vector<double> q, v;
  Motion<double> frame{{0.3, -0.7, 1.1}, {0.5, 0.9, -0.4}};

  explicit State(int n) {
    for (int k = 0; k < n; ++k) {
      q.push_back(0.1 * std::sin(1.0 + k));
      v.push_back(0.4 * std::cos(2.0 * k));
    }
  }
  OwnState<double> own() const { return {q.data(), v.data(), nullptr}; }
};

/// Energy of 4,000 points of the centre line whose places are differentiated in time, and of their
/// sections, which turn with the frame and by slopes and twist.
double energy_of_points(const BeamModes& of, const State& state, const Motion<double>& v) {
  constexpr int count = 4000;
  constexpr double h = 1e-6;
  double sum = 0;
  const double none[most_coordinates] = {};
  for (int i = 0; i < count; ++i) {
    const double x = of.of.length * (i + 0.5) / count, share = of.of.length / count;
    const BeamModes::Station at = of.station(x);
    const auto place = [&](double t) {
      std::vector<double> q = state.q;
      for (int k = 0; k < of.n; ++k) q[k] += t * state.v[k];
      return beam::point(of, at, OwnState<double>{q.data(), nullptr, nullptr}, none).r;
    };
    const Vec3<double> speed = v.lin + cross(v.ang, place(0)) + (0.5 / h) * (place(h) - place(-h));
    sum += 0.5 * of.of.mass_per_length * share * dot(speed, speed);
    Vec3<double> turn = v.ang;
    turn.x += x / of.of.length * state.v[of.twist()];
    for (int k = 0; k < of.in_plane; ++k) {
      turn.z += of.shape(0, k, x, 1) * state.v[of.first(0) + k];
      turn.y -= of.shape(1, k, x, 1) * state.v[of.first(1) + k];
    }
    sum += 0.5 * share *
           ((of.of.rotary_y + of.of.rotary_z) * turn.x * turn.x + of.of.rotary_y * turn.y * turn.y +
            of.of.rotary_z * turn.z * turn.z);
  }
  return sum;
}

class Beams : public ::testing::TestWithParam<std::pair<int, bool>> {};

TEST_P(Beams, HaveTheEnergyOfTheirPoints) {
  const auto [interior, stretches] = GetParam();
  const Beam beam = make(properties(interior, stretches));
  const State state(beam.n_coordinates());
  const double want = energy_of_points(*beam.modes, state, beam.to_beam * state.frame);
  EXPECT_NEAR(kinetic_energy(beam, state.frame, state.own()), want, 3e-7 * want);
}

/// The power of what a body takes without acceleration is half of the change of its inertia:
/// v^T p = 1/2 v^T M' v. With that and M right, p is up to forces without power.
TEST_P(Beams, KeepTheirEnergy) {
  const auto [interior, stretches] = GetParam();
  const Beam beam = make(properties(interior, stretches));
  const int n = beam.n_coordinates();
  const State state(n);
  OwnEquationsHere<double> of;
  calc_equations(beam, state.frame, state.own(), of);
  double power = dot(state.frame, of.p);
  for (int k = 0; k < n; ++k) power += state.v[k] * of.p_e[k];
  constexpr double h = 1e-6;
  State before = state, after = state;
  for (int k = 0; k < n; ++k) {
    before.q[k] -= h * state.v[k];
    after.q[k] += h * state.v[k];
  }
  const double change = (kinetic_energy(beam, state.frame, after.own()) -
                         kinetic_energy(beam, state.frame, before.own())) /
                        (2 * h);
  EXPECT_NEAR(power, change, 1e-8 * (1 + std::abs(change)));
}

TEST_P(Beams, AreRigidWhereStraight) {
  const auto [interior, stretches] = GetParam();
  const Beam beam = make(properties(interior, stretches));
  State state(beam.n_coordinates());
  std::fill(state.q.begin(), state.q.end(), 0.0);
  std::fill(state.v.begin(), state.v.end(), 0.0);
  OwnEquationsHere<double> of;
  calc_equations(beam, state.frame, state.own(), of);
  ArticulatedInertia<double> straight{};
  add_inertia(straight, beam);
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(of.M.A.m[i], straight.A.m[i], 1e-13);
    EXPECT_NEAR(of.M.C.m[i], straight.C.m[i], 1e-13);
  }
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(of.M.B.m[i], straight.B.m[i], 1e-13);
}

INSTANTIATE_TEST_SUITE_P(Sizes, Beams,
                         ::testing::Values(std::pair(0, true), std::pair(1, false),
                                           std::pair(2, true), std::pair(4, true)));

/// Of a slender beam clamped at one end: k L of Euler and Bernoulli 1.8751, 4.6941, 7.8548.
TEST(Beam, HasTheModesOfTextbooks) {
  BeamProperties of = properties(4, true);
  of.rotary_y = of.rotary_z = 1e-9;
  const BeamModes modes(of);
  const double roots[] = {1.8751040687, 4.6940911330, 7.8547574382};
  const double tolerance[] = {1e-8, 2e-5, 3e-3};
  for (int p = 0; p < 2; ++p)
    for (int k = 0; k < 3; ++k) {
      const int at = modes.first(p) + k;
      const double omega = std::sqrt(modes.stiffness[at] / modes.m_e[packed(at, at)]);
      const double want = roots[k] * roots[k] / (of.length * of.length) *
                          std::sqrt((p == 0 ? of.EIz : of.EIy) / of.mass_per_length);
      EXPECT_NEAR(omega, want, tolerance[k] * want) << p << k;
      EXPECT_NEAR(modes.damping[at], 2 * of.damping_ratio * modes.stiffness[at] / omega,
                  1e-12 * modes.damping[at]);
      for (int l = 0; l < k; ++l)  // modes do not move each other
        EXPECT_NEAR(modes.m_e[packed(at, modes.first(p) + l)], 0, 1e-12);
    }
}

/// Under a force F and a moment M at its end the tip goes by F L^3 / 3 EI + M L^2 / 2 EI and turns
/// by F L^2 / 2 EI + M L / EI, however few modes it has.
TEST(Beam, BendsExactlyUnderLoadsAtItsEnd) {
  for (int interior = 0; interior <= most_interior_modes; ++interior) {
    const BeamProperties of = properties(interior, true);
    const BeamModes modes(of);
    constexpr double F = 3, M = -0.7;
    const double L = of.length;
    double tip = 0, slope = 0;
    for (int k = 0; k < modes.in_plane; ++k) {
      const int at = modes.first(0) + k;
      const double shape = modes.shape(0, k, L), turn = modes.shape(0, k, L, 1);
      const double eta = (F * shape + M * turn) / modes.stiffness[at];
      tip += eta * shape;
      slope += eta * turn;
    }
    EXPECT_NEAR(tip, F * L * L * L / (3 * of.EIz) + M * L * L / (2 * of.EIz), 1e-14);
    EXPECT_NEAR(slope, F * L * L / (2 * of.EIz) + M * L / of.EIz, 1e-14);
  }
}

TEST(Beam, SaysWhatIsWrong) {
  BeamProperties of = properties(0, true);
  const auto fault = [&] {
    const auto* first = reinterpret_cast<const double*>(&of);
    return Beam::fault({first, static_cast<size_t>(Beam::n_parameters)});
  };
  EXPECT_EQ(fault(), "");
  of.EIy = 0;
  EXPECT_EQ(fault(), "the beam's EIy is not positive; give a value above 0");
  of = properties(5, true);
  EXPECT_EQ(fault(),
            "the beam's interior_modes is not a number from 0 to 4; give one, or more "
            "bodies");
}

}  // namespace
}  // namespace linkwise::testing
