// What errors of the tree do to what closes loops, against finite differences.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/forces/coordinate_forces.hpp"
#include "linkwise/simulate/loop_watch.hpp"
#include "linkwise/simulate/parent_axes.hpp"

namespace linkwise::testing {
namespace {

struct Watched {
  explicit Watched(const LoopedMachine& machine)
      : model(std::make_shared<const Model>(machine.model)),
        setup(model, {}),
        axes(*model),
        y(machine.q) {
    setup.settle();
    forces.emplace(setup);
    forces->hold(machine.q.data());
    std::vector<double> v = machine.v;
    axes.from_child(machine.q.data(), v.data());
    y.insert(y.end(), v.begin(), v.end());
    watch.emplace(setup, *forces,
                  [this](double, double* state) { axes.to_child(state, state + model->nq()); });
  }
  /// What a small change of y along `way` does to coordinates and rates that close loops, behind
  /// each other.
  std::vector<double> difference(const std::vector<double>& way) {
    std::vector<double> out(model->loops.nq + model->loops.nv), moved(y.size());
    for (const double step : {1e-6, -1e-6}) {
      for (size_t i = 0; i < y.size(); ++i) moved[i] = y[i] + step * way[i];
      watch->update(0, moved.data());
      for (int k = 0; k < model->loops.nq; ++k) out[k] += watch->q()[model->nq() + k] / (2 * step);
      for (int k = 0; k < model->loops.nv; ++k)
        out[model->loops.nq + k] += watch->v()[model->nv() + k] / (2 * step);
    }
    watch->update(0, y.data());
    return out;
  }

  std::shared_ptr<const Model> model;
  linkwise::Setup setup;
  ParentAxes axes;
  std::vector<double> y;
  std::optional<LoopForces> forces;
  std::optional<LoopWatch> watch;
};

TEST(LoopWatch, SlopesBoundWhatErrorsOfTheTreeDo) {
  Draws draws(23);
  using enum JointType;
  for (const JointType type :
       {revolute, prismatic, helical, cylindrical, universal, spherical, planar, floating}) {
    SCOPED_TRACE(static_cast<int>(type));
    LoopedMachine machine(tree_spec({floating, revolute, spherical, revolute, prismatic, planar,
                                     revolute, universal, revolute},
                                    {-1, 0, 1, 2, 0, 4, 5, 6, -1}, draws),
                          draws);
    machine.close(type, 3, 7, draws);
    machine.close(type, -1, 8, draws);
    Watched at(machine);
    const Model& m = *at.model;
    double largest = 0;
    for (int trial = 0; trial < 20; ++trial) {
      // A change that keeps the loops closed: of coordinates, and then of rates.
      LoopedMachine other = machine;
      for (double& v : other.v) v = draws.uniform(-1, 1);
      other.make_consistent();
      std::vector<double> way(at.y.size());
      if (trial % 2 == 0)
        for (const Element& e : m.elements)
          element_position_rate(e, machine.q.data(), other.v.data(), way.data());
      else
        std::copy(other.v.begin(), other.v.end(), way.begin() + m.nq());
      const std::vector<double> found = at.difference(way);
      for (const Element& e : m.loops.elements)
        for (int k = 0; k < e.nv; ++k) {
          double position = 0, rate = 0;
          for (const LoopWatch::Slope& slope : at.watch->slopes(m.nv() + e.v + k)) {
            position += slope.position * std::abs(way[slope.of]);
            rate += slope.rate * std::abs(way[slope.of]);
          }
          largest = std::max(largest, rate);
          EXPECT_LE(std::abs(found[m.loops.nq + e.v + k]), rate + 1e-6);
          if (has_scalar_coordinates(e)) EXPECT_LE(std::abs(found[e.q + k]), position + 1e-6);
        }
    }
    EXPECT_GT(largest, 0.1);
  }
}

TEST(LoopWatch, SlopesByHingesAreExact) {
  Draws draws(24);
  using enum JointType;
  for (const JointType type : {revolute, prismatic, cylindrical, universal}) {
    LoopedMachine machine(
        tree_spec({revolute, revolute, prismatic, revolute, helical}, {-1, 0, 1, -1, 3}, draws),
        draws);
    machine.close(type, 2, 4, draws);
    Watched at(machine);
    const Model& m = *at.model;
    for (int i = 0; i < m.nv(); ++i) {
      std::vector<double> way(at.y.size());
      way[m.nq() + i] = 1;
      const std::vector<double> found = at.difference(way);
      for (int k = 0; k < m.loops.nv; ++k)
        for (const LoopWatch::Slope& slope : at.watch->slopes(m.nv() + k)) {
          const double exact = std::abs(found[m.loops.nq + k]);
          if (slope.of == i) EXPECT_NEAR(slope.position, exact, 1e-7);
          if (slope.of == m.nq() + i) EXPECT_NEAR(slope.rate, exact, 1e-7);
        }
    }
  }
}

TEST(LoopWatch, InertiaIsThatOfTheJointInTheTree) {
  Watched at{LoopedMachine(wheel_on_two_bearings())};
  at.watch->update(0, at.y.data());
  EXPECT_NEAR(at.watch->inertia(1), 2, 1e-12);
}

}  // namespace
}  // namespace linkwise::testing
