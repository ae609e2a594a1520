// Many simulations at once against the same simulations one by one.
#include <atomic>

#include <gtest/gtest.h>

#include "dynamics/looped_machine.hpp"
#include "linkwise/base/error.hpp"
#include "linkwise/simd/lanes.hpp"
#include "linkwise/simulate/batch_simulation.hpp"
#include "simulate/recording.hpp"

namespace linkwise::testing {
namespace {

using enum JointType;

/// The one method of batches.
SimulationOptions steps_of(double step, std::string_view kind = "runge_kutta_4") {
  return with(fixed_step(step, kind), {"articulated_body"});
}

constexpr auto go_on = [] { return true; };

/// Initial states and torques of several members, and everything that is recorded of them.
struct Members {
  size_t count, times;
  std::vector<double> q, v, tau;
  std::vector<double> position, velocity, acceleration, load, torque, kinetic, potential;

  Members(const Model& m, size_t members, size_t instants) : count(members), times(instants) {
    Draws draws(17);
    for (size_t i = 0; i < count; ++i) {
      const MachineState state = random_state(m, draws);
      q.insert(q.end(), state.q.begin(), state.q.end());
      v.insert(v.end(), state.v.begin(), state.v.end());
    }
    tau = random_values(count * m.nv(), draws, 3);
    position.assign(count * times * m.nq(), 7);
    for (auto* array : {&velocity, &acceleration, &torque})
      array->assign(count * times * m.nv(), 7);
    load.assign(count * times * 6 * m.n_joints(), 7);
    kinetic.assign(count * times, 7);
    potential.assign(count * times, 7);
  }
  Start start() const { return {q.data(), v.data(), tau.data(), count}; }
  Sample samples() {
    Sample out;
    out["position"] = position.data();
    out["velocity"] = velocity.data();
    out["acceleration"] = acceleration.data();
    out["joint_load"] = load.data();
    out["drive_torque"] = torque.data();
    out["kinetic_energy"] = kinetic.data();
    out["potential_energy"] = potential.data();
    return out;
  }
  std::vector<double> row(const std::vector<double>& of, size_t member, size_t time) const {
    const size_t width = of.size() / (count * times);
    const auto first = of.begin() + (member * times + time) * width;
    return {first, first + width};
  }
  /// Every member's arrays one after the other, to compare runs bit by bit.
  std::vector<double> everything() const {
    std::vector<double> all;
    for (const auto* a :
         {&position, &velocity, &acceleration, &load, &torque, &kinetic, &potential})
      all.insert(all.end(), a->begin(), a->end());
    return all;
  }
};

/// Drives and wrenches of every kind that a batch takes, on joints that take them.
void drive(Simulation& simulation, bool given_motions) {
  const Model& m = simulation.model();
  Drive pd;
  pd.kind = DriveKind::pd;
  pd.kp = 20;
  pd.kd = 2;
  pd.value = {0.4};
  simulation.set_drive(0, pd);
  Drive table;
  table.kind = DriveKind::torque_table;
  table.table = Table{{0, 1}, 1, 1, {4, -2}};
  simulation.set_drive(m.n_joints() - 1, table);
  Wrench world, body;
  world.joint = 1;
  world.value = {1, 2, 3, 4, 5, 6};
  body.joint = m.n_joints() - 1;
  body.world = false;
  body.value = {-3, 1, 0, 2, 0, 1};
  simulation.add_wrench(world);
  simulation.add_wrench(body);
  if (!given_motions) return;
  Drive motion;
  motion.kind = DriveKind::motion;
  motion.table = Table{{0, 1}, 3, 1, {0.5, -1, 0.3, 0.2}};
  simulation.set_drive(0, motion);
}

class BatchSimulation : public ::testing::TestWithParam<bool> {};

// From one member to two full groups and one more.
TEST_P(BatchSimulation, EqualsOneByOne) {
  const auto model = make_model(every_kind());
  const std::vector<double> times = {0, 0.0137, 0.1};
  for (std::string_view kind : {"runge_kutta_4", "semi_implicit_euler"}) {
    const SimulationOptions options = steps_of(1e-3, kind);
    Simulation shared(model, options);
    drive(shared, GetParam());
    for (size_t count = 1; count <= 2 * native_lanes + 1; ++count) {
      Members members(*model, count, times.size());
      for (size_t i = 0; i < count; ++i)  // none where there is a drive
        members.tau[i * model->nv()] = members.tau[(i + 1) * model->nv() - 1] = 0;
      const Simulation* const all[] = {&shared};
      const auto ends =
          simulate_batch(all, members.start(), times, members.samples(), Executor(1), go_on);
      for (size_t i = 0; i < count; ++i) {
        EXPECT_EQ(ends[i].outcome, Outcome::converged);
        EXPECT_EQ(ends[i].time, 0.1);
        Simulation alone(model, options);
        drive(alone, GetParam());
        // A constant torque is a drive of its own.
        std::vector<double> q(members.q.begin() + i * model->nq(), members.q.end());
        std::vector<double> v(members.v.begin() + i * model->nv(), members.v.end());
        for (int j = 1; j + 1 < model->n_joints(); ++j) {
          const JointInfo& info = model->joints[j];
          Drive torque;
          torque.kind = DriveKind::torque;
          const auto first = members.tau.begin() + i * model->nv() + info.v;
          torque.value = {first, first + info.nv};
          alone.set_drive(j, torque);
        }
        alone.start(0, {q.data(), v.data()});
        const auto want = run(alone, times);
        ASSERT_EQ(want.size(), times.size());
        for (size_t k = 0; k < times.size(); ++k) {
          SCOPED_TRACE(std::to_string(i) + " of " + std::to_string(count) + " at time " +
                       std::to_string(times[k]));
          expect_close(members.row(members.position, i, k), want[k].q, 1e-10, "position");
          expect_close(members.row(members.velocity, i, k), want[k].v, 1e-10, "velocity");
          expect_close(members.row(members.acceleration, i, k), want[k].du, 1e-9, "acceleration");
          expect_close(members.row(members.load, i, k), want[k].loads, 1e-9, "load");
          expect_close(members.row(members.torque, i, k), want[k].drive_torque, 1e-9, "torque");
          expect_close(members.row(members.kinetic, i, k), {want[k].kinetic}, 1e-9, "kinetic");
          expect_close(members.row(members.potential, i, k), {want[k].potential}, 1e-9,
                       "potential");
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(GivenMotions, BatchSimulation, ::testing::Bool());

TEST(BatchSimulation, SeveralModels) {
  ModelSpec heavy_spec = every_kind();
  heavy_spec.links.back().mass += 3;
  const auto light = make_model(every_kind()), heavy = make_model(heavy_spec);
  Simulation one(light, steps_of(1e-2)), other(heavy, steps_of(1e-2));
  const Simulation* const both[] = {&one, &other};
  const std::vector<double> times = {0.1};
  const size_t per = native_lanes + 1;
  Members together(*light, 2 * per, 1);
  simulate_batch(both, together.start(), times, together.samples(), Executor(2), go_on);
  for (size_t m = 0; m < 2; ++m) {
    Members apart(*light, per, 1);
    const Start start{together.q.data() + m * per * light->nq(),
                      together.v.data() + m * per * light->nv(),
                      together.tau.data() + m * per * light->nv(), per};
    const Simulation* const single[] = {both[m]};
    simulate_batch(single, start, times, apart.samples(), Executor(1), go_on);
    const auto first = together.load.begin() + m * apart.load.size();
    EXPECT_EQ(apart.load, std::vector<double>(first, first + apart.load.size()));
  }
}

TEST(BatchSimulationThreads, SameBits) {
  const auto model = make_model(every_kind());
  Simulation shared(model, steps_of(1e-2));
  drive(shared, false);
  const Simulation* const all[] = {&shared};
  const std::vector<double> times = {0, 0.05, 0.2};
  std::vector<double> first;
  for (int threads : {1, 1, 2, 3, 7}) {
    Members members(*model, 5 * native_lanes + 3, times.size());
    simulate_batch(all, members.start(), times, members.samples(), Executor(threads), go_on);
    if (first.empty()) first = members.everything();
    EXPECT_EQ(members.everything(), first) << threads << " threads";
  }
}

// Without gravity and at its target, a member rests however stiff its spring is; the others'
// springs are too stiff for the step, and what they do is not to be seen in it.
TEST(BatchSimulation, AMemberThatFailsEndsAlone) {
  Draws draws(3);
  ModelSpec spec = tree_spec({revolute, revolute, revolute}, chain_parents(3), draws);
  spec.gravity = {0, 0, 0};
  const auto model = make_model(spec);
  Simulation shared(model, steps_of(0.1));
  Drive stiff;
  stiff.kind = DriveKind::pd;
  stiff.kp = 1e7;
  stiff.value = {0};
  for (int j = 0; j < 3; ++j) shared.set_drive(j, stiff);
  const Simulation* const all[] = {&shared};
  const std::vector<double> times = {0, 0.1, 1000};
  Members members(*model, native_lanes + 2, times.size());
  const size_t at_rest[] = {1, native_lanes + 1};
  for (size_t i : at_rest)
    for (int k = 0; k < 3; ++k) members.q[3 * i + k] = members.v[3 * i + k] = 0;
  std::fill(members.tau.begin(), members.tau.end(), 0);
  const auto ends =
      simulate_batch(all, members.start(), times, members.samples(), Executor(2), go_on);
  for (size_t i = 0; i < members.count; ++i) {
    const bool rests = i == at_rest[0] || i == at_rest[1];
    EXPECT_EQ(ends[i].outcome, rests ? Outcome::converged : Outcome::not_finite) << i;
    EXPECT_TRUE(rests ? ends[i].time == 1000 : ends[i].time < 100) << ends[i].time;
    EXPECT_TRUE(std::isfinite(members.row(members.load, i, 1)[0]));
    for (const auto* array : {&members.position, &members.load, &members.kinetic})
      for (double x : members.row(*array, i, 2))
        if (rests)
          EXPECT_EQ(x, 0);
        else
          EXPECT_TRUE(std::isnan(x));
  }
}

// Its accelerations are not determined, which is said before the start.
TEST(BatchSimulation, AMachineThatCannotMove) {
  const auto model = make_model(singular_spec());
  Simulation shared(model, steps_of(1e-2));
  const Simulation* const all[] = {&shared};
  const std::vector<double> times = {0, 0.1};
  Members members(*model, native_lanes + 1, times.size());
  EXPECT_THROW(simulate_batch(all, members.start(), times, members.samples(), Executor(1), go_on),
               InputError);
}

// Members that one simulation starts together are those of a batch, bit by bit.
TEST(BatchSimulation, IsOneSimulationOfSeveralMembers) {
  const auto model = make_model(every_kind());
  Simulation shared(model, steps_of(1e-2));
  const Simulation* const all[] = {&shared};
  const std::vector<double> times = {0, 0.1};
  Members batch(*model, native_lanes, times.size()), one(*model, native_lanes, times.size());
  simulate_batch(all, batch.start(), times, batch.samples(), Executor(1), go_on);
  Simulation together(model, steps_of(1e-2));
  together.start(0, one.start());
  Sample samples = one.samples();
  samples.rows = times.size();
  for (size_t k = 0; k < times.size(); ++k)
    EXPECT_TRUE(together.advance(times[k], samples.at(*model, 0, k)));
  EXPECT_EQ(one.everything(), batch.everything());
}

TEST(BatchSimulation, StopsWhenItIsAskedTo) {
  const auto model = make_model(pendulum());
  Simulation shared(model, steps_of(1e-3));
  const Simulation* const all[] = {&shared};
  const std::vector<double> times = {0, 0.01, 1e9};
  for (int threads : {1, 3}) {
    Members members(*model, 3 * native_lanes, times.size());
    std::atomic<int> asked{0};
    const auto ends = simulate_batch(all, members.start(), times, members.samples(),
                                     Executor(threads), [&] { return ++asked < 100; });
    for (const Ending& end : ends) EXPECT_EQ(end.outcome, Outcome::interrupted);
    EXPECT_TRUE(std::isfinite(members.row(members.position, 3 * native_lanes - 1, 0)[0]));
    EXPECT_TRUE(std::isnan(members.row(members.position, 0, 2)[0]));
  }
}

TEST(BatchSimulation, RefusesWhatItCannotTake) {
  const auto model = make_model(pendulum());
  for (std::string_view kind : all_kinds()) {
    Simulation simulation(model, steps_of(1e-3, kind));
    if (simulation.setup().options.integration.step > 0)
      EXPECT_NO_THROW(check_members(simulation.setup()));
    else
      EXPECT_THROW(check_members(simulation.setup()), InputError);
  }
  // The method and the state, at the one door as well.
  const auto tree = make_model(every_kind());
  const Members two(*tree, 2, 1);
  for (const Formulation& f : {Formulation{"auto"}, Formulation{"constraint_force"},
                               Formulation{"constraint_force", find_state("body_velocities")}}) {
    Simulation other(tree, with(fixed_step(1e-3), f));
    EXPECT_NO_THROW(other.start(0, {two.q.data(), two.v.data()}));
    EXPECT_THROW(other.start(0, two.start()), InputError);
  }
  Simulation driven(model, steps_of(1e-3));
  Drive function;
  function.kind = DriveKind::torque_callable;
  function.callable = [](double, const double*, const double*, double* out) { *out = 0; };
  driven.set_drive(0, function);
  EXPECT_THROW(check_members(driven.setup()), InputError);
  Simulation pushed(model, steps_of(1e-3));
  Wrench wrench;
  wrench.callable = [](double, double* out) { std::fill_n(out, 6, 0.0); };
  pushed.add_wrench(wrench);
  EXPECT_THROW(check_members(pushed.setup()), InputError);
}

// Loops are closed, eliminated and projected for each member by itself.
TEST(BatchSimulation, OfClosedLoopsEqualsOneByOne) {
  const auto model = make_model(row_of_four_bars(2));
  const std::vector<double> times = {0, 0.05, 0.1};
  constexpr size_t members = 3;
  const size_t nq = model->nq(), nv = model->nv();
  std::vector<double> q(members * nq), v(members * nv), at(members * times.size() * nq, 7);
  for (size_t i = 0; i < members; ++i) q[i * nq] = 0.3 + 0.1 * static_cast<double>(i);
  Sample samples;
  samples["position"] = at.data();
  Simulation shared(model, steps_of(1e-3));
  const Simulation* const all[] = {&shared};
  MemberNotes notes;
  const auto ends = simulate_batch(all, {q.data(), v.data(), nullptr, members}, times, samples,
                                   Executor(2), go_on, nullptr, &notes);
  for (size_t i = 0; i < members; ++i) {
    EXPECT_EQ(ends[i].outcome, Outcome::converged);
    EXPECT_NE(notes.loops[i].assembled, "");
    Simulation alone(model, steps_of(1e-3));
    alone.start(0, {q.data() + i * nq, v.data() + i * nv});
    for (size_t k = 0; k < times.size(); ++k) {
      std::vector<double> own(nq);
      Sample one;
      one["position"] = own.data();
      ASSERT_TRUE(alone.advance(times[k], one));
      for (size_t c = 0; c < nq; ++c) EXPECT_EQ(at[(i * times.size() + k) * nq + c], own[c]);
    }
  }
}

}  // namespace
}  // namespace linkwise::testing
