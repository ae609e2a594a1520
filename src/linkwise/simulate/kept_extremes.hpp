#pragma once
// The extremes of every member along the steps of a run.
#include <functional>
#include <span>
#include <vector>

#include "linkwise/base/outcome.hpp"
#include "linkwise/simulate/extremes.hpp"

namespace linkwise {

class KeptExtremes {
 public:
  /// The state at a time within the last step: positions of all members, then their rates. It holds
  /// until the next call.
  using StateAt = std::function<const std::vector<double>&(double t)>;

  /// The setup must outlive this. tau: as of Start. directions: those of Extremes.
  KeptExtremes(const Setup& setup, size_t members, const double* tau,
               const std::vector<double>& directions, StateAt state_at);

  /// For what is to be set before begin().
  std::vector<Extremes>& of_members() { return of_; }
  void begin(double t, const std::vector<double>& y);
  /// A step that ends at t, once it is reached as a whole; breaks: what acts jumps there. Members
  /// that have ended are passed over.
  void add_step(double t, bool breaks, std::span<const Ending> endings);
  /// Of one member until t, within the last step, Extremes::size() numbers. loads_open: peaks of
  /// loads have no bound.
  std::vector<double> found(size_t member, double t, bool running, bool loads_open);

 private:
  void interpolate_step(double t);
  void add(size_t member, double t, bool breaks, Extremes& to) const;

  size_t members_, nq_, nv_;
  StateAt state_at_;
  std::vector<Extremes> of_;
  double until_ = 0;
  std::vector<double> middle_, end_;  ///< of the step at hand
};

}  // namespace linkwise
