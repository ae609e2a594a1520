#include "linkwise/simulate/work.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "linkwise/forces/passive.hpp"
#include "linkwise/kinematics/frame_motion.hpp"

namespace linkwise {
namespace {

/// A kink in the powers, where a motion is put together from pieces, is closed in until what is
/// missed no longer counts.
constexpr int most_halvings = 24;
/// Per step, of motions that are rough everywhere.
constexpr size_t most_pieces = 1024;

struct Rule {
  std::array<double, WorkIntegral::most_nodes> nodes{}, weights{};  ///< on [-1, 1]
};

/// Legendre polynomials of degree 0 to n at x.
std::array<double, WorkIntegral::most_nodes + 1> legendre(int n, double x) {
  std::array<double, WorkIntegral::most_nodes + 1> p{1, x};
  for (int k = 2; k <= n; ++k) p[k] = ((2 * k - 1) * x * p[k - 1] - (k - 1) * p[k - 2]) / k;
  return p;
}

/// Gauss-Legendre, by Newton's method from Chebyshev's nodes.
Rule gauss_legendre(int n) {
  Rule rule;
  for (int i = 0; i < n; ++i) {
    double x = -std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int iteration = 0; iteration < 20; ++iteration) {
      const auto p = legendre(n, x);
      slope = n * (x * p[n] - p[n - 1]) / (x * x - 1);
      x -= p[n] / slope;
    }
    rule.nodes[i] = x;
    rule.weights[i] = 2 / ((1 - x * x) * slope * slope);
  }
  return rule;
}

const Rule& rule_of(int n) {
  static const auto rules = [] {
    std::array<Rule, WorkIntegral::most_nodes + 1> all;
    for (int k = 1; k <= WorkIntegral::most_nodes; ++k) all[k] = gauss_legendre(k);
    return all;
  }();
  return rules[n];
}

/// Power of what the joints' damping, friction and the damping of stops do. Springs and stops at
/// rest store what they take.
double passive_power(const Model& model, const double* q, const double* v) {
  if (!model.has_passive_forces()) return 0;
  const size_t n = model.nv();
  std::vector<double> moving(n), resting(n);
  const std::vector<double> rest(n);
  add_passive_forces(model, q, v, moving.data());
  add_passive_forces(model, q, rest.data(), resting.data());
  double power = 0;
  for (size_t i = 0; i < n; ++i) power += (moving[i] - resting[i]) * v[i];
  return power;
}

double external_power(const Model& model, const double* external, const double* q,
                      const double* v) {
  if (!external) return 0;
  double power = 0;
  for (int j = 0; j < model.n_joints(); ++j) {
    const double* wrench = external + 6 * j;
    if (std::all_of(wrench, wrench + 6, [](double x) { return x == 0; })) continue;
    const Motion<double> rate = frame_motion(model, q, v, nullptr, {.joint = j}).velocity;
    const double rates[6] = {rate.lin.x, rate.lin.y, rate.lin.z,
                             rate.ang.x, rate.ang.y, rate.ang.z};
    power += std::inner_product(wrench, wrench + 6, rates, 0.0);
  }
  return power;
}

}  // namespace

WorkIntegral::WorkIntegral(const Model& model, size_t members, double t0)
    : width_(width(model)),
      begin_(t0),
      end_(t0),
      at_end_(members * width_),
      until_(members * width_) {}

void WorkIntegral::add_step(double t, int nodes, double tolerance, const Powers& powers) {
  if (!known_) return;
  begin_ = end_;
  end_ = t;
  nodes_ = std::clamp(nodes, 1, most_nodes);
  tolerance_ = tolerance;
  pieces_.clear();
  Piece whole = piece(begin_, end_, powers);
  if (tolerance > 0)
    halve(std::move(whole), most_halvings, powers);
  else
    pieces_.push_back(std::move(whole));
  for (Piece& part : pieces_) {
    part.at_begin = at_end_;
    add(part, 1, at_end_);
  }
}

WorkIntegral::Piece WorkIntegral::piece(double begin, double end, const Powers& powers) {
  Piece made{begin, end, std::vector<double>(nodes_ * at_end_.size()), {}};
  const Rule& rule = rule_of(nodes_);
  for (int k = 0; k < nodes_ && known_; ++k)
    known_ = powers(begin + (end - begin) * (1 + rule.nodes[k]) / 2,
                    made.powers.data() + k * at_end_.size());
  return made;
}

void WorkIntegral::halve(Piece whole, int depth, const Powers& powers) {
  const double middle = whole.begin + (whole.end - whole.begin) / 2;
  Piece left = piece(whole.begin, middle, powers), right = piece(middle, whole.end, powers);
  if (!known_ || depth == 0 || pieces_.size() >= most_pieces || adds_up(whole, left, right)) {
    pieces_.push_back(std::move(left));
    pieces_.push_back(std::move(right));
    return;
  }
  halve(std::move(left), depth - 1, powers);
  halve(std::move(right), depth - 1, powers);
}

/// Of each member, against the largest of its works in the step. True for NaN, which no halving
/// cures.
bool WorkIntegral::adds_up(const Piece& whole, const Piece& left, const Piece& right) const {
  const size_t n = at_end_.size();
  std::vector<double> one(n), two(n);
  add(whole, 1, one);
  add(left, 1, two);
  add(right, 1, two);
  double largest = 0;
  for (const double power : whole.powers) largest = std::max(largest, std::abs(power));
  for (size_t i = 0; i < n; ++i)
    if (std::abs(one[i] - two[i]) > tolerance_ * (end_ - begin_) * largest) return false;
  return true;
}

void WorkIntegral::reach(double t) {
  if (t == end_ || pieces_.empty()) {
    until_ = at_end_;
    return;
  }
  const auto after = [t](const Piece& part) { return t < part.end; };
  const auto found = std::find_if(pieces_.begin(), pieces_.end(), after);
  const Piece& part = found == pieces_.end() ? pieces_.back() : *found;
  until_ = part.at_begin;
  add(part, (t - part.begin) / (part.end - part.begin), until_);
}

/// The integral of the polynomial through the powers, whose sum of Legendre polynomials P_k has
/// coefficients (2 k + 1) / 2 times the sum of weight P_k(node) power over the nodes; that of P_k
/// from -1 to x is (P_k+1(x) - P_k-1(x)) / (2 k + 1).
void WorkIntegral::add(const Piece& piece, double fraction, std::vector<double>& works) const {
  const Rule& rule = rule_of(nodes_);
  const auto at = legendre(nodes_, 2 * fraction - 1);
  for (int j = 0; j < nodes_; ++j) {
    const auto at_node = legendre(nodes_, rule.nodes[j]);
    double share = at[1] + 1;
    for (int k = 1; k < nodes_; ++k) share += at_node[k] * (at[k + 1] - at[k - 1]);
    const double factor = (piece.end - piece.begin) * rule.weights[j] * share / 4;
    for (size_t i = 0; i < works.size(); ++i)
      works[i] += factor * piece.powers[j * works.size() + i];
  }
}

void write_powers(const Model& model, const AppliedForces& forces, size_t member, const double* q,
                  const double* v, double* powers) {
  const size_t n = model.nv();
  for (size_t i = 0; i < n; ++i) powers[i] = forces.drive(member)[i] * v[i];
  const LoopForces* loops = forces.loops();
  const size_t n_loops = model.loops.nv;
  for (size_t i = 0; i < n_loops; ++i) powers[n + i] = loops->drive()[i] * loops->v()[i];
  powers[n + n_loops] = external_power(model, forces.external(member), q, v);
  powers[n + n_loops + 1] = -passive_power(model, q, v) + (loops ? loops->dissipated() : 0);
}

}  // namespace linkwise
