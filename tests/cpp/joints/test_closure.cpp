#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/joints/closure.hpp"
#include "model/machines.hpp"

namespace linkwise::testing {
namespace {

/// The stack of a joint as a model places it, its pose and its columns.
struct Stack {
  Stack(JointType type, Draws& draws)
      : model([&] {
          ModelSpec spec = tree_spec({type}, {-1}, draws);
          spec.joints[0].axes.resize(type == JointType::universal ? 2 : 1);
          return spec;
        }()),
        stack(model.elements) {
    if (type != JointType::fixed) return;  // welded: no element in a tree
    Element weld;
    weld.kind = ElementKind::fixed;
    weld.nq = weld.nv = 0;
    weld.placement = {random_rotation(draws), random_vector3(draws)};
    stack.assign(1, weld);
  }

  Model model;
  std::vector<Element> stack;
  std::span<const Element> elements() const { return stack; }
  Transform<double> pose(const std::vector<double>& q) const {
    Transform<double> X = element_pose(elements()[0], q.data());
    for (size_t i = 1; i < elements().size(); ++i) X = element_pose(elements()[i], q.data()) * X;
    return X;
  }
  std::vector<Motion<double>> columns(const std::vector<double>& q) const {
    std::vector<Motion<double>> P;
    for (const Element& e : elements()) {
      const Transform<double> X = element_pose(e, q.data());
      for (auto& column : P) column = X * column;
      for (int k = 0; k < e.nv; ++k) P.push_back(element_column<double>(e, k));
    }
    return P;
  }
  std::vector<double> position(Draws& draws) const {
    std::vector<double> q(model.nq());
    for (double& x : q) x = draws.normal();
    for (const Element& e : elements())
      if (const int first = info_of(e.kind).quaternion; first >= 0) {
        double* p = q.data() + e.q + first;
        const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
        for (int i = 0; i < 4; ++i) p[i] /= length;
      }
    return q;
  }
};

/// F moved by t times a motion in its own axes.
Transform<double> moved(const Transform<double>& X, const Vector6<double>& motion, double t) {
  const Vec3<double> turn{t * motion[3], t * motion[4], t * motion[5]};
  const double angle = std::sqrt(dot(turn, turn)),
               half = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
  const double p[4] = {half * turn.x, half * turn.y, half * turn.z, std::cos(angle / 2)};
  const Vec3<double> slide{t * motion[0], t * motion[1], t * motion[2]};
  return Transform<double>{rotation_to_child(p), slide} * X;
}

class EveryClosure : public ::testing::TestWithParam<JointType> {
 protected:
  Draws draws{7};
};

TEST_P(EveryClosure, CoordinatesComeBackFromThePose) {
  for (int sample = 0; sample < 20; ++sample) {
    const Stack stack(GetParam(), draws);
    ASSERT_TRUE(can_close(stack.elements()));
    const std::vector<double> q = stack.position(draws);
    std::vector<double> found = q;
    for (double& x : found) x += 0.3 * draws.normal();
    closure_coordinates(stack.elements(), stack.pose(q), found.data());
    for (size_t i = 0; i < q.size(); ++i) EXPECT_NEAR(found[i], q[i], 2e-14) << i;
    for (const double x : closure_gap(stack.pose(found), stack.pose(q))) EXPECT_NEAR(x, 0, 3e-14);
  }
}

TEST_P(EveryClosure, RatesComeBackAndTheRestIsHeld) {
  const Stack stack(GetParam(), draws);
  const auto P = stack.columns(stack.position(draws));
  ClosureBasis basis;
  calc_closure_basis(P.data(), static_cast<int>(P.size()), basis);
  Vector6<double> motion{};
  std::vector<double> u;
  for (const auto& column : P) {
    u.push_back(draws.normal());
    for (int i = 0; i < 6; ++i) motion[i] += u.back() * to_array(column)[i];
  }
  for (size_t i = 0; i < P.size(); ++i) EXPECT_NEAR(along(basis.dual[i], motion), u[i], 1e-13);
  for (int i = 0; i < basis.rows(); ++i) {
    EXPECT_NEAR(along(basis.Q[i], motion), 0, 1e-14);
    for (int j = 0; j < basis.rows(); ++j)
      EXPECT_NEAR(along(basis.Q[i], basis.Q[j]), i == j, 1e-15);
  }
}

// Where the gap is closed, F moving in any direction opens it by Q^T times the motion.
TEST_P(EveryClosure, ResidualsGrowAsTheRowsSay) {
  const Stack stack(GetParam(), draws);
  const std::vector<double> q = stack.position(draws);
  const auto P = stack.columns(q);
  ClosureBasis at;
  calc_closure_basis(P.data(), static_cast<int>(P.size()), at);
  const Transform<double> X = stack.pose(q);
  for (int direction = 0; direction < 6; ++direction) {
    Vector6<double> motion{};
    motion[direction] = 1;
    const auto moved_by = [&](double t, double* g) {
      std::vector<double> found = q;
      const Transform<double> X_FE = moved(X, motion, t);
      closure_coordinates(stack.elements(), X_FE, found.data());
      const auto columns = stack.columns(found);
      ClosureBasis basis;
      calc_closure_basis(columns.data(), static_cast<int>(columns.size()), basis);
      closure_residual(basis, closure_gap(stack.pose(found), X_FE), g);
    };
    constexpr double h = 1e-4;
    double more[6], less[6];
    moved_by(h, more);
    moved_by(-h, less);
    for (int i = 0; i < at.rows(); ++i)
      EXPECT_NEAR((more[i] - less[i]) / (2 * h), at.Q[i][direction], 2e-7) << i;
  }
}

// F moving as the joint lets it: the coordinates change as a tree joint's would.
TEST_P(EveryClosure, CoordinatesFollowTheRates) {
  const Stack stack(GetParam(), draws);
  const std::vector<double> q = stack.position(draws);
  std::vector<double> u, rate(q.size());
  Vector6<double> motion{};
  for (const auto& column : stack.columns(q)) {
    u.push_back(draws.normal());
    for (int i = 0; i < 6; ++i) motion[i] += u.back() * to_array(column)[i];
  }
  for (const Element& e : stack.elements())
    element_position_rate(e, q.data(), u.data(), rate.data());
  constexpr double h = 1e-4;
  const auto moved_by = [&](double t) {
    std::vector<double> found = q;
    closure_coordinates(stack.elements(), moved(stack.pose(q), motion, t), found.data());
    return found;
  };
  const std::vector<double> ahead = moved_by(h), behind = moved_by(-h);
  for (size_t i = 0; i < q.size(); ++i)
    EXPECT_NEAR((ahead[i] - behind[i]) / (2 * h), rate[i], 1e-6) << i;
}

INSTANTIATE_TEST_SUITE_P(Closures, EveryClosure,
                         ::testing::ValuesIn(std::vector(std::begin(all_joint_types),
                                                         std::end(all_joint_types) - 1)),
                         [](const auto& test) { return std::string(joint_type_name(test.param)); });

TEST(Closure, TurnsAreCounted) {
  Draws draws(3);
  const Stack hinge(JointType::continuous, draws);
  for (const double angle : {-20.0, -3.2, 3.1, 3.2, 40.5}) {
    double q = angle - 0.4;
    closure_coordinates(hinge.elements(), hinge.pose({angle}), &q);
    EXPECT_NEAR(q, angle, 1e-13);
  }
  const Stack screw(JointType::helical, draws);
  double q = 0;  // how far it has advanced tells the turn
  closure_coordinates(screw.elements(), screw.pose({-19.5}), &q);
  EXPECT_NEAR(q, -19.5, 1e-13);
}

TEST(Closure, GivenCoordinatesStay) {
  Draws draws(3);
  const Stack hinge(JointType::revolute, draws);
  Element held = hinge.elements()[0];
  held.prescribed = true;
  double q = 0.25;
  closure_coordinates(std::span(&held, 1), hinge.pose({0.3}), &q);
  EXPECT_EQ(q, 0.25);
  const auto gap = closure_gap(hinge.pose({0.25}), hinge.pose({0.3}));
  EXPECT_NEAR(gap[5], 0.05, 1e-15);
}

TEST(Closure, RotationVectorsOfEverySize) {
  const Vec3<double> axis{2.0 / 7, -3.0 / 7, 6.0 / 7};
  for (const double angle : {0.0, 1e-12, 1e-5, 0.7, 2.0, 3.1, std::numbers::pi - 1e-9}) {
    const double s = std::sin(angle / 2);
    const double p[4] = {s * axis.x, s * axis.y, s * axis.z, std::cos(angle / 2)};
    const Vec3<double> found = rotation_vector(rotation_to_child(p));
    EXPECT_NEAR(found.x, angle * axis.x, 1e-15 + 2e-15 * angle);
    EXPECT_NEAR(found.y, angle * axis.y, 1e-15 + 2e-15 * angle);
    EXPECT_NEAR(found.z, angle * axis.z, 1e-15 + 2e-15 * angle);
  }
}

TEST(Closure, StacksOfMoreElementsAreNotKnown) {
  Draws draws(3);
  const Model composite(tree_spec({JointType::composite}, {-1}, draws));
  EXPECT_FALSE(can_close(composite.elements));
}

}  // namespace
}  // namespace linkwise::testing
