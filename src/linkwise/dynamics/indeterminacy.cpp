#include "linkwise/dynamics/indeterminacy.hpp"

#include <algorithm>
#include <cmath>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/articulated_loops.hpp"
#include "linkwise/kinematics/coupling_states.hpp"

namespace linkwise {
namespace {

/// Of the largest component of a self-stress: what is less is rounding.
constexpr double touched = 1e-8;

/// Makes the largest component 1, where moments count by a length; what loads no joint stays 0.
void normalise(double* loads, size_t n_loads, double length) {
  double largest = 0;
  for (size_t i = 0; i < 6 * n_loads; ++i)
    largest = std::max(largest, std::abs(loads[i]) / (i % 6 < 3 ? 1 : length));
  for (size_t i = 0; largest > 0 && i < 6 * n_loads; ++i) loads[i] /= largest;
}

/// Marks the components that a self-stress loads.
void mark(const double* loads, double length, std::vector<char>& marks) {
  for (size_t i = 0; i < marks.size(); ++i)
    if (std::abs(loads[i]) > touched * (i % 6 < 3 ? 1 : length)) marks[i] = 1;
}

}  // namespace

Indeterminacy find_indeterminacy(const Model& model, const double* q) {
  Indeterminacy out;
  const size_t n_loads = model.n_loads();
  out.determinate.assign(6 * n_loads, 1);
  out.by_bearings.assign(6 * n_loads, 0);
  out.couplings.assign(model.n_couplings(), 1);
  for (const Element& e : model.elements) out.mobility += e.prescribed ? 0 : e.nv;
  if (!model.is_constrained()) return out;
  ArticulatedLoops kernel(model);
  const std::vector<double> zero(model.nv());
  std::vector<double> du(model.nv()), loads(6 * n_loads);
  SweepInput<double> in;
  in.q = q;
  in.tau = zero.data();
  const bool regular = kernel.evaluate(in, du.data(), loads.data());
  require_closed(model, kernel.states());
  require_coupled(model, kernel.states(), q, nullptr);
  if (!regular)
    throw InputError("body '" + model.body_name(kernel.failed_body()) + "'" + model.where() +
                     ": its articulated inertia is not positive definite; give it mass and "
                     "inertia");
  out.rows = kernel.report().rows;
  const double length = kernel.longest_loop();
  std::vector<char> by_any(loads.size()), by_open(loads.size());
  std::vector<char> open_couplings(model.n_couplings());
  for (int g = 0; g < static_cast<int>(kernel.groups().size()); ++g) {
    const int n = kernel.find_self_stresses(g);
    for (int k = 0; k < n; ++k) {
      kernel.self_stress(g, k, q, loads.data());
      normalise(loads.data(), n_loads, length);
      mark(loads.data(), length, by_any);
      out.self_stresses.insert(out.self_stresses.end(), loads.begin(), loads.end());
    }
    out.n_self_stresses += n;
    kernel.append_undecided(g, q, out.undecided, open_couplings);
  }
  for (int c = 0; c < model.n_couplings(); ++c) out.couplings[c] = !open_couplings[c];
  out.n_undecided = static_cast<int>(out.undecided.size() / loads.size());
  for (int k = 0; k < out.n_undecided; ++k) {
    double* const own = &out.undecided[k * loads.size()];
    normalise(own, n_loads, length);
    mark(own, length, by_open);
  }
  for (size_t i = 0; i < loads.size(); ++i) {
    out.determinate[i] = !by_open[i];
    out.by_bearings[i] = by_any[i] && !by_open[i];
  }
  out.rank = out.rows - out.n_self_stresses;
  out.mobility -= out.rank;
  return out;
}

}  // namespace linkwise
