// Newton's stiff part as the recursion solves it, against the matrix I - gamma J itself: forces
// differentiated by differences, and divided by the mass matrix by the method that simulates.
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "base/draws.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/forces/passive.hpp"
#include "linkwise/model/flexible_link.hpp"
#include "linkwise/simulate/stiff_part.hpp"

namespace linkwise::testing {
namespace {

/// A free hull with a slider on its stop, a table in a plane, a ball with a damper, and a damped
/// elastic boom whose hand is driven and rubs.
ModelSpec machine() {
  ModelSpec spec;
  spec.floating_base = true;
  const Sym3<double> J{{0.1, 0, 0.2, 0, 0, 0.15}};
  spec.links = {{"hull", 5, {0, 0.1, 0}, {{1, 0, 1.2, 0, 0, 0.9}}},
                {"slider", 1, {0.1, 0, 0}, J},
                {"table", 2, {0, 0, 0.2}, J},
                {"boom", 2, {}, {}},
                {"hand", 0.5, {0, 0, 0.1}, J},
                {"tail", 0.4, {0.1, 0, 0}, J}};
  const auto add = [&](const char* name, JointType type, const char* parent, const char* child,
                       std::vector<DofValue> dof) {
    JointSpec joint;
    joint.name = name;
    joint.type = type;
    joint.parent = parent;
    joint.child = child;
    joint.dof = std::move(dof);
    spec.joints.push_back(joint);
  };
  using enum DofProperty;
  add("rail", JointType::prismatic, "hull", "slider",
      {{upper, {0.2}}, {limit_stiffness, {1e6}}, {limit_damping, {3}}, {stiffness, {50}}});
  add("plane", JointType::planar, "hull", "table", {{stiffness, {1e4}}, {damping, {70}}});
  add("turn", JointType::revolute, "hull", "boom", {{armature, {0.3}}});
  add("wrist", JointType::revolute, "boom", "hand",
      {{friction, {4e4}}, {friction_velocity, {1e3}}});
  add("ball", JointType::spherical, "boom", "tail", {{damping, {30}}});
  spec.joints[0].axes = {{AxisKind::prismatic, {0, 0.6, 0.8}, 0}};
  spec.joints[1].axes = {{AxisKind::revolute, {0, 0, 1}, 0}};
  spec.joints[2].axes = {{AxisKind::revolute, {0, 0.8, 0.6}, 0}};
  spec.joints[3].axes = {{AxisKind::revolute, {0.6, 0.8, 0}, 0}};
  spec.joints[3].translation = spec.joints[4].translation = {0.9, 0.2, 0.4};
  FlexibleLink boom;
  boom.link = "boom";
  boom.E = 2e9;
  boom.G = 8e8;
  boom.area = 1e-3;
  boom.Iy = 3e-7;
  boom.Iz = 2e-7;
  boom.J = 1e-7;
  boom.damping = 0.02;
  boom.bodies = 2;
  return with_flexible_link(spec, boom);
}

class StiffMatrix {
 public:
  explicit StiffMatrix(const std::shared_ptr<Setup>& setup)
      : setup_(setup),
        model_(setup->driven()),
        axes_(model_),
        method_(make_dynamics(model_, setup->options.dynamics)) {}

  /// (I - gamma J) z, and how large its terms are.
  void times(const std::vector<double>& y, double gamma, const std::vector<double>& z,
             std::vector<double>& out, std::vector<double>& size) {
    const size_t nq = model_.nq(), nv = model_.nv();
    std::vector<double> rate(z.begin() + nq, z.end()), force(nv), du(nv), qdot(nq);
    // Forces change with coordinates by differences in z's own direction.
    for (const double step : {1e-4, -1e-4}) {
      std::vector<double> moved(y);
      for (size_t i = 0; i < y.size(); ++i) moved[i] += step * z[i];
      axes_.to_child(y.data(), moved.data() + nq);  // forces turn with what they act on
      const std::vector<double> at = forces(moved);
      for (size_t i = 0; i < nv; ++i) force[i] += at[i] / (2 * step);
    }
    SweepInput<double> in;
    in.q = y.data();
    in.tau = force.data();
    in.gravity_factor = 0;
    const std::vector<double> none(nv);
    in.v = none.data();
    in.prescribed = none.data();
    EXPECT_TRUE(method_->evaluate(0, in, du.data(), nullptr).ok());
    axes_.from_child(y.data(), du.data());
    axes_.to_child(y.data(), rate.data());
    for (const Element& e : model_.elements)
      element_position_rate(e, y.data(), rate.data(), qdot.data());
    out = size = z;
    for (size_t i = 0; i < z.size(); ++i) {
      const double change = gamma * (i < nq ? qdot[i] : du[i - nq]);
      out[i] -= change;
      size[i] = std::abs(z[i]) + std::abs(change);
    }
  }

 private:
  std::vector<double> forces(const std::vector<double>& state) {
    std::vector<double> tau(model_.nv());
    const double *q = state.data(), *v = q + model_.nq();
    add_passive_forces(model_, q, v, tau.data());
    add_drive_torques(model_, setup_->drives, 0, q, v, tau.data());
    return tau;
  }

  std::shared_ptr<Setup> setup_;
  const Model& model_;
  ParentAxes axes_;
  std::unique_ptr<DynamicsMethod> method_;
};

struct Case {
  Case() : model(std::make_shared<const Model>(machine())) {
    SimulationOptions options;
    options.dynamics.method = "articulated_body";
    setup = std::make_shared<Setup>(model, options);
    for (int j = 0; j < model->n_joints(); ++j)
      if (model->joints[j].name == "wrist") {
        Drive drive;
        drive.kind = DriveKind::pd;
        drive.value = {0.4};
        drive.kp = 3e3;
        drive.kd = 200;
        setup->set_drive(j, drive);
      }
    setup->settle();
    y.assign(model->nq() + model->nv(), 0.0);
    for (const Element& e : model->elements) {
      if (info_of(e.kind).quaternion >= 0) {
        double* x = y.data() + e.q + info_of(e.kind).quaternion;
        x[0] = 0.5, x[1] = -0.1, x[2] = 0.7, x[3] = std::sqrt(0.25);
      } else {
        for (int k = 0; k < e.nq; ++k) y[e.q + k] = e.kind == ElementKind::elastic ? 1e-7 : 0.25;
        // A force that turns with its joint is geometry, not stiffness.
        if (e.kind == ElementKind::planar) y[e.q] = y[e.q + 1] = 0;
      }
    }
  }
  std::shared_ptr<const Model> model;
  std::shared_ptr<Setup> setup;
  std::vector<double> y;
};

TEST(StiffPart, SolvesTheMatrixOfStiffForces) {
  Case machine;
  StiffMatrix matrix(machine.setup);
  ASSERT_TRUE(StiffPart::suits(*machine.setup));
  StiffPart part(*machine.setup);
  Draws draws(7);
  const size_t n = machine.y.size(), nq = machine.model->nq();
  for (const double gamma : {1e-6, 1e-4, 1e-2}) {
    ASSERT_TRUE(part.factor(machine.y.data(), gamma));
    for (int draw = 0; draw < 5; ++draw) {
      std::vector<double> r(n), z(n), back, size;
      for (double& x : r) x = draws.uniform(-1, 1);
      for (size_t i = 0; i < nq; ++i) r[i] *= gamma;  // or what follows moves on at 1 / gamma
      part.solve(r.data(), z.data());
      matrix.times(machine.y, gamma, z, back, size);
      double largest = 0;
      for (size_t i = nq; i < n; ++i) largest = std::max(largest, size[i]);
      for (size_t i = 0; i < nq; ++i) EXPECT_NEAR(back[i], r[i], 1e-11 * size[i]) << i;
      for (size_t i = nq; i < n; ++i) EXPECT_NEAR(back[i], r[i], 1e-8 * largest) << i;
    }
  }
}

TEST(StiffPart, LeavesEverythingWhereNothingIsStiff) {
  const auto model = std::make_shared<const Model>([] {
    ModelSpec spec = machine();
    for (JointSpec& joint : spec.joints)
      if (joint.type != JointType::elastic) joint.dof.clear();
    return spec;
  }());
  linkwise::Setup setup(model, {});
  setup.settle();
  StiffPart part(setup);
  std::vector<double> y(model->nq() + model->nv()), r(y.size(), 0.0), z(y.size());
  for (const Element& e : model->elements)
    if (info_of(e.kind).quaternion >= 0) y[e.q + info_of(e.kind).quaternion + 3] = 1;
  r[model->nq()] = 2;  // of the hull
  ASSERT_TRUE(part.factor(y.data(), 0.0));
  part.solve(r.data(), z.data());
  EXPECT_EQ(z, r);
}

}  // namespace
}  // namespace linkwise::testing
