#pragma once
// States at the ends of the last steps, and the polynomials through them: dense output of methods
// that have none of their own, or whose own asks for rates that stiffness magnifies.
//
// Velocities are interpolated through eight ends, or, where there are fewer, through four and the
// derivatives at both ends of the step. Ends that lie close together beside the length of the step
// are passed over, because polynomials through them magnify what steps leave of errors. Positions
// are the integral of the rates that these velocities give at five places (Lobatto), corrected
// linearly to meet both ends. How large this correction is tells whether all of it is true.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "linkwise/integrate/checked_system.hpp"

namespace linkwise {

class StepHistory {
 public:
  /// Nothing but the state y at t.
  void restart(double t, std::span<const double> y) {
    count_ = 0;
    add(t, y);
  }
  void add(double t, std::span<const double> y) {
    std::rotate(ends_.begin(), ends_.end() - 1, ends_.end());
    ends_[0].t = t;
    ends_[0].y.assign(y.begin(), y.end());
    ends_[0].has_rates = false;
    count_ = std::min(count_ + 1, most);
    sampled_ = false;
  }
  void drop_last() {
    std::rotate(ends_.begin(), ends_.begin() + 1, ends_.end());
    --count_;
    sampled_ = false;
  }
  bool has_step() const { return count_ > 1; }

  /// y(t) within the last step, not projected. Evaluations are made aside.
  void interpolate(double t, CheckedSystem& system, std::span<double> y) {
    sample_rates(system);
    const std::size_t nq = system.position_size();
    const double h = ends_[0].t - ends_[1].t, x = (t - ends_[1].t) / h;
    std::copy_n(ends_[1].y.begin(), nq, y.begin());
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double weight = h * integrated(k, x);
      for (std::size_t i = 0; i < nq; ++i) y[i] += weight * rates_[k][i];
    }
    for (std::size_t i = 0; i < nq; ++i) y[i] += x * h * missing_[i];
    std::fill(y.begin() + static_cast<std::ptrdiff_t>(nq), y.end(), 0.0);
    add_velocities(t, nq, y.subspan(nq));
  }

  /// How far the rates within the last step are from what positions have moved by, as a mean over
  /// the step: the largest of |qdot - qdot'| / (1 + |qdot|). Of a smooth motion it is of high
  /// order.
  double contradiction(CheckedSystem& system) {
    sample_rates(system);
    const double h = ends_[0].t - ends_[1].t;
    double largest = 0.0;
    for (std::size_t i = 0; i < missing_.size(); ++i) {
      const double rate = std::abs(ends_[0].y[i] - ends_[1].y[i]) / h;
      largest = std::max(largest, std::abs(missing_[i]) / (1 + rate));
    }
    return largest;
  }

 private:
  struct End {
    double t = 0.0;
    std::vector<double> y, rate;
    bool has_rates = false;
  };

  /// On [0, 1], with the weights of their quadrature.
  static constexpr std::array<double, 5> places{0, 0.17267316464601143, 0.5, 0.8273268353539886, 1},
      weights{0.05, 0.2722222222222222, 0.35555555555555557, 0.2722222222222222, 0.05};

  /// Chooses ends, and finds rates of positions at all places and what their mean lacks.
  void sample_rates(CheckedSystem& system) {
    if (sampled_) return;
    choose_for_velocities(system);
    const std::size_t nq = system.position_size();
    const double h = ends_[0].t - ends_[1].t;
    missing_.resize(nq);
    for (std::size_t i = 0; i < nq; ++i) missing_[i] = (ends_[0].y[i] - ends_[1].y[i]) / h;
    for (const std::size_t k : {0, 4, 1, 2, 3}) {
      state_.assign(system.size(), 0.0);
      add_velocities(ends_[1].t + places[k] * h, nq, std::span(state_).subspan(nq));
      // Positions matter here only where they are quaternions: a cubic will do.
      for (std::size_t i = 0; i < nq; ++i) state_[i] = k == 0 ? ends_[1].y[i] : ends_[0].y[i];
      for (std::size_t i = 0; i < nq && k % 4 != 0; ++i) state_[i] = by_cubic(i, places[k], h);
      rates_[k].resize(nq);
      system->position_rates(state_.data(), state_.data() + nq, rates_[k].data());
      for (std::size_t i = 0; i < nq; ++i) missing_[i] -= weights[k] * rates_[k][i];
    }
    sampled_ = true;
  }

  /// Position i at x of the step, from positions and rates of its ends.
  double by_cubic(std::size_t i, double x, double h) const {
    const double moved = ends_[0].y[i] - ends_[1].y[i];
    const double begin = h * rates_[0][i] - moved, end = h * rates_[4][i] - moved;
    return ends_[1].y[i] + x * (moved + (1 - x) * ((1 - x) * begin - x * end));
  }

  /// The integral from 0 to x of the polynomial that is 1 at place k and 0 at the others.
  static double integrated(std::size_t k, double x) {
    // Three places of Gauss are exact for its degree, 4.
    constexpr double at[] = {0.1127016653792583, 0.5, 0.8872983346207417};
    constexpr double weight[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    double sum = 0.0;
    for (int g = 0; g < 3; ++g) {
      double product = weight[g] * x;
      for (std::size_t j = 0; j < places.size(); ++j)
        if (j != k) product *= (at[g] * x - places[j]) / (places[k] - places[j]);
      sum += product;
    }
    return sum;
  }

  void choose_for_velocities(CheckedSystem& system) {
    constexpr double share = 0.6;  // of the step, between ends
    chosen_ = {&ends_[0], &ends_[1]};
    const double apart = share * (ends_[0].t - ends_[1].t);
    for (std::size_t i = 2; i < count_ && chosen_.size() < without_rates; ++i)
      if (chosen_.back()->t - ends_[i].t >= apart) chosen_.push_back(&ends_[i]);
    with_rates_ = 0;
    if (chosen_.size() == without_rates) return;
    chosen_.resize(std::min(chosen_.size(), beside_rates));
    with_rates_ = 2;
    for (std::size_t i = 0; i < with_rates_; ++i) {
      End& end = *chosen_[i];
      if (end.has_rates) continue;
      end.rate.resize(end.y.size());
      system.evaluate_aside(end.t, end.y.data(), end.rate.data());
      end.has_rates = true;
    }
  }

  /// Adds the polynomial through the chosen ends, the first of which have rates, for the components
  /// from `first` on. L_i = prod ((t - t_j) / (t_i - t_j))^m_j, m_j = 2 with rates, carries y_i, or
  /// (1 - L_i'(t_i) (t - t_i)) y_i + (t - t_i) ydot_i.
  void add_velocities(double t, std::size_t first, std::span<double> out) const {
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const End& end = *chosen_[i];
      double share = 1.0, slope = 0.0;
      for (std::size_t j = 0; j < chosen_.size(); ++j) {
        if (j == i) continue;
        const double x = (t - chosen_[j]->t) / (end.t - chosen_[j]->t);
        share *= j < with_rates_ ? x * x : x;
        slope += (j < with_rates_ ? 2.0 : 1.0) / (end.t - chosen_[j]->t);
      }
      const bool has_rate = i < with_rates_;
      const double of_rate = has_rate ? (t - end.t) * share : 0.0;
      const double of_value = has_rate ? share - slope * of_rate : share;
      for (std::size_t k = 0; k < out.size(); ++k) out[k] += of_value * end.y[first + k];
      for (std::size_t k = 0; has_rate && k < out.size(); ++k)
        out[k] += of_rate * end.rate[first + k];
    }
  }

  static constexpr std::size_t without_rates = 8, beside_rates = 4, most = 16;
  std::array<End, most> ends_;  ///< the last one first
  std::size_t count_ = 0, with_rates_ = 0;
  std::vector<End*> chosen_;
  bool sampled_ = false;  ///< of the last step
  std::array<std::vector<double>, places.size()> rates_;
  std::vector<double> missing_, state_;
};

}  // namespace linkwise
