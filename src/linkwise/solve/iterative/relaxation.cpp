// Block over-relaxation on A~ = 1 + O: node by node, x_i += omega (b_i - (A~ x)_i).
//
// Each local step is an exact line search along the block for omega = 1 and lowers the squared
// A-norm of the error by (2 - omega) omega |b_i - (A~ x)_i|^2, whatever the order of the nodes: the
// stop test gets the decrease of a sweep without a product with A.

#include "linkwise/solve/iterative/relaxation.hpp"

#include <algorithm>
#include <numeric>

#include "linkwise/linear/vector.hpp"

namespace linkwise {

void colour_nodes(const ScaledTree& system, std::vector<int>& colours) {
  const int n = system.n();
  colours.resize(n);
  // Joints of one hub get consecutive colours, skipping the inboard joint's.
  std::vector<int> next(system.hubs.size(), 0);
  for (int i = 0; i < n; ++i) {
    const int p = system.parent[i];
    if (p < 0) {
      colours[i] = 0;
    } else if (system.lever_of[i] < 0) {
      colours[i] = colours[p] == 0 ? 1 : 0;
    } else {
      int& colour = next[system.hub[p]];
      if (colour == colours[p]) ++colour;
      colours[i] = colour++;
    }
  }
}

Outcome Relaxation::prepare(const BlockTree&) {
  if (!scaled().structure_changed()) return Outcome::converged;
  sums_.resize(6 * scaled().hubs.size());
  change_.resize(scaled().size());
  residual_.resize(scaled().size());
  sequence_.resize(scaled().n());
  std::iota(sequence_.begin(), sequence_.end(), 0);
  if (order_ == SweepOrder::by_colour) {
    colour_nodes(scaled(), colours_);
    std::stable_sort(sequence_.begin(), sequence_.end(),
                     [this](int a, int b) { return colours_[a] < colours_[b]; });
  }
  return Outcome::converged;
}

int Relaxation::default_max_iterations(int) const { return 20000; }

double Relaxation::sweep(std::span<const double> b, std::span<double> x, double omega) {
  const ScaledTree& system = scaled();
  // Afresh in every sweep, so that rounding in the running sums does not accumulate.
  system.hub_sums(x, sums_);
  const auto relax = [&](int begin, int end) {
    double square = 0.0;
    for (int s = begin; s < end; ++s) {
      const int i = sequence_[s], at = system.offset[i], dim = system.dim[i];
      double row[6];
      for (int k = 0; k < dim; ++k) row[k] = b[at + k] - x[at + k];
      system.add_row(i, x.data(), sums_.data(), row, -1.0);
      for (int k = 0; k < dim; ++k) {
        row[k] *= omega;
        square += row[k] * row[k];
        change_[at + k] = row[k];
        x[at + k] += row[k];
      }
      system.update_sums(i, row, sums_.data());
    }
    return square;
  };
  if (order_ == SweepOrder::base_to_tip) return relax(0, system.n());
  // Nodes of one colour share neither an unknown nor a hub's sum.
  double total = 0.0;
  for (int first = 0, end = 0; first < system.n(); first = end) {
    while (end < system.n() && colours_[sequence_[end]] == colours_[sequence_[first]]) ++end;
    total += Tiles(end - first, TileOf::nodes).sum(executor(), [&](int from, int to) {
      return relax(first + from, first + to);
    });
  }
  return total;
}

void Relaxation::iterate(std::span<const double> b, std::span<double> x, StopTest& stop) {
  double change = 0.0, previous = 0.0;
  start();
  while (true) {
    const double omega = relaxation_factor(change, previous);
    previous = change;
    change = sweep(b, x, omega);
    if (stop.needs_residual()) {
      multiply(x, residual_);
      subtract_from(b, residual_, executor());
    }
    IterationStep step;
    step.decrease = (2.0 - omega) / omega * change;
    step.solution_energy = dot(x, b, executor());
    step.x = x;
    step.change = change_;
    step.residual = residual_;
    if (stop.stops(step)) return;
  }
}

}  // namespace linkwise
