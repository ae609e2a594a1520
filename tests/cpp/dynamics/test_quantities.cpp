#include <vector>

#include <gtest/gtest.h>

#include "dynamics/dynamics_case.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/quantities.hpp"
#include "linkwise/kinematics/frame_motion.hpp"

namespace linkwise::testing {
namespace {

class Quantities : public ::testing::TestWithParam<Machine> {
 protected:
  Quantities() {
    Draws draws(31);
    state = random_state(model, draws);
    motions = twin.motions(state.q, state.v);
  }
  Model model{GetParam().spec};
  WorldTwin twin{model};
  MachineState state;
  WorldTwin::Motions<double> motions;
};

std::vector<double> flat(const Pose<double>& pose) {
  const auto& [R, p] = pose;
  return {R.m[0], R.m[1], R.m[2], p.x, R.m[3], R.m[4], R.m[5], p.y,
          R.m[6], R.m[7], R.m[8], p.z, 0,      0,      0,      1};
}

TEST_P(Quantities, PosesAreTheTwins) {
  std::vector<double> joints(16 * model.n_joints()), links(16 * model.links.size());
  joint_poses(model, state.q.data(), joints.data());
  link_poses(model, state.q.data(), links.data());
  const auto part = [](const std::vector<double>& all, size_t i) {
    return std::vector<double>(all.begin() + 16 * i, all.begin() + 16 * (i + 1));
  };
  for (int j = 0; j < model.n_joints(); ++j)
    expect_close(part(joints, j), flat(motions.pose[model.joints[j].link]), 1e-13,
                 "pose at " + model.joints[j].name);
  for (size_t l = 0; l < model.links.size(); ++l)
    expect_close(part(links, l), flat(motions.pose[l]), 1e-13, "pose of " + model.links[l].name);
}

/// Velocity of a point p of a link in the world, and the link's turning.
Motion<double> velocity_at(const Screw<double>& v, const Vec3<double>& p) {
  return {v.s + cross(v.w, p), v.w};
}

std::vector<double> numbers(const Motion<double>& m) {
  return {m.lin.x, m.lin.y, m.lin.z, m.ang.x, m.ang.y, m.ang.z};
}

TEST_P(Quantities, JacobiansAndVelocitiesOfFramesAreTheTwins) {
  constexpr double tolerance = 1e-12;  // what axes may differ by that count as parallel
  Draws draws(57);
  const size_t nv = model.nv();
  std::vector<double> J(6 * nv);
  for (size_t l = 0; l < model.links.size(); ++l) {
    const Frame frame{model.links[l].name, {random_rotation(draws), random_vector3(draws)}};
    const FramePlacement at = place_frame(model, frame);
    const Pose<double>& link = motions.pose[l];
    const Vec3<double> point = link.p + link.R * frame.placement.r;
    const Mat3<double> R = link.R * transpose(frame.placement.R);  // frame -> world
    const Motion<double> world = velocity_at(motions.velocity[l], point);
    const Motion<double> own{transpose_times(R, world.lin), transpose_times(R, world.ang)};
    for (const bool world_axes : {false, true}) {
      frame_jacobian(model, state.q.data(), at, world_axes, J.data());
      std::vector<double> got(6);
      for (size_t r = 0; r < 6; ++r)
        for (size_t k = 0; k < nv; ++k) got[r] += J[r * nv + k] * state.v[k];
      expect_close(got, numbers(world_axes ? world : own), tolerance,
                   "velocity by J, " + frame.link);
    }
    const FrameMotion found = frame_motion(model, state.q.data(), state.v.data(), nullptr, at);
    expect_close(numbers(found.velocity), numbers(own), tolerance, "velocity of " + frame.link);
    const Mat3<double>& turned = found.pose.R;
    for (int i = 0; i < 9; ++i) EXPECT_NEAR(turned.m[i], transpose(R).m[i], tolerance);
    expect_close({found.pose.r.x, found.pose.r.y, found.pose.r.z}, {point.x, point.y, point.z},
                 tolerance, "origin on " + frame.link);
  }
}

TEST_P(Quantities, EnergiesAndMomentaAreSumsOverTheLinks) {
  const ModelSpec& spec = model.spec();
  double kinetic = 0, potential = 0, mass = 0;
  Vec3<double> p, L;
  for (size_t l = 0; l < spec.links.size(); ++l) {
    if (model.links[l].joint < 0) continue;  // welded to the ground
    const LinkSpec& link = spec.links[l];
    const Pose<double>& at = motions.pose[l];
    const Vec3<double> w = motions.velocity[l].w, c = at.p + at.R * link.com;
    const Vec3<double> v = motions.velocity[l].s + cross(w, c);
    const Vec3<double> spin = at.R * (link.inertia * transpose_times(at.R, w));
    kinetic += link.mass * dot(v, v) / 2 + dot(w, spin) / 2;
    potential -= link.mass * dot(spec.gravity, c);
    mass += link.mass;
    p += link.mass * v;
    L += spin + cross(c, link.mass * v);
  }
  for (int i = 0; i < model.nv(); ++i)
    kinetic += model.dof_values(DofProperty::armature)[i] * state.v[i] * state.v[i] / 2;
  std::vector<double> h(6);
  momentum(model, state.q.data(), state.v.data(), h.data());
  expect_close(h, {p.x, p.y, p.z, L.x, L.y, L.z}, 1e-12, "momentum");
  EXPECT_NEAR(kinetic_energy(model, state.q.data(), state.v.data()), kinetic,
              1e-12 * (1 + kinetic));
  EXPECT_NEAR(potential_energy(model, state.q.data()), potential,
              1e-12 * (1 + std::abs(potential)));
  EXPECT_NEAR(model.total_mass(), mass, 1e-13 * (1 + mass));
}

INSTANTIATE_TEST_SUITE_P(Machines, Quantities, ::testing::ValuesIn(all_machines()),
                         [](const auto& test) { return test.param.name; });

// Frames turn about exactly the axis that was given, whatever it is, and are the user's frames
// at zero.
TEST(Axes, OfEveryDirectionAreTurnedAbout) {
  const Vec3<double> axes[] = {{1, 0, 0},          {-1, 0, 0},         {0, 1, 0},    {0, -1, 0},
                               {0, 0, 1},          {0, 0, -1},         {1e-9, 0, 1}, {1e-9, 0, -1},
                               {0, -1e-200, -1},   {1, 1, 1e-17},      {3, -4, 0},   {-3, 4, -12},
                               {1e150, 0, -1e150}, {1e-150, 1e-150, 0}};
  Draws draws(32);
  for (const Vec3<double>& axis : axes) {
    ModelSpec spec = tree_spec({JointType::revolute, JointType::helical}, chain_parents(2), draws);
    for (JointSpec& j : spec.joints) j.axes[0].axis = axis;
    const Model model(spec);
    const WorldTwin twin(model);
    for (const std::vector<double>& q : {std::vector<double>{0, 0}, {1.2, -0.7}}) {
      std::vector<double> poses(32);
      joint_poses(model, q.data(), poses.data());
      const auto want = twin.motions(q, std::vector<double>(2));
      for (int j = 0; j < 2; ++j) {
        const std::vector<double> pose(poses.begin() + 16 * j, poses.begin() + 16 * (j + 1));
        expect_close(pose, flat(want.pose[j + 1]), 1e-14, "pose");
        for (int i = 0; i < 16 && q[0] == 0 && j == 0; ++i)
          if (i % 4 < 3 && i < 12) {
            EXPECT_NEAR(pose[i], spec.joints[0].rotation.m[3 * (i / 4) + i % 4], 1e-15);
          }
      }
    }
  }
}

}  // namespace
}  // namespace linkwise::testing
