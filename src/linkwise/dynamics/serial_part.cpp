#include "linkwise/dynamics/serial_part.hpp"

#include <chrono>

namespace linkwise {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_each(Clock::time_point started, int repeats) {
  return std::chrono::duration<double>(Clock::now() - started).count() / repeats;
}

}  // namespace

SerialPart measure_serial_part(const Model& model, const SweepInput<double>& in, int sums,
                               int repeats) {
  const int n = model.n_bodies();
  std::vector<BodyState<double>> state(n);
  std::vector<GeneralState<double>> general(model.n_general);
  calc_body_states(model, in, state.data(), general.data());
  // The bodies' own shares, which their processors have ready.
  std::vector<Motion<double>> own(n), v(n);
  std::vector<double> partial(n);
  for (int i = 0; i < n; ++i) {
    const int parent = model.topology[i].parent;
    const Motion<double> carried = parent >= 0 ? state[i].X * state[parent].v : Motion<double>{};
    own[i] = {state[i].v.lin - carried.lin, state[i].v.ang - carried.ang};
    partial[i] = 1.0 / (i + 1);
  }

  SerialPart part;
  // What the compiler cannot foresee, so that it keeps the loops.
  volatile double input = 1e-300, result = 0;
  Clock::time_point started = Clock::now();
  for (int k = 0; k < repeats; ++k)
    for (int s = 0; s < sums; ++s) {
      double sum = input;
      for (int i = 0; i < n; ++i) sum += partial[i];
      result = sum;
    }
  part.sums = seconds_each(started, repeats);

  started = Clock::now();
  for (int k = 0; k < repeats; ++k) {
    own[0].ang.x += input;
    for (int i = 0; i < n; ++i) {
      const int parent = model.topology[i].parent;
      v[i] = own[i];
      if (parent >= 0) v[i] += state[i].X * v[parent];
    }
    result = v[n - 1].ang.x;
  }
  part.velocities = seconds_each(started, repeats);
  static_cast<void>(result);
  return part;
}

}  // namespace linkwise
