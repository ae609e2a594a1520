#pragma once
// Carries a machine through singular positions, where its loops hold fewer directions than
// elsewhere: a parallelogram stretched straight, for one. Its motion is smooth there, but what the
// constraints demand is a difference of nearly equal numbers over the square of the distance, and
// steps would become smaller without end. In a narrow window around such a position the
// accelerations are those of the polynomial through the last ones before it, or of one through
// positions beside it where these are far apart: see Simulation::accelerate_from_beside().
// A machine may also come close to such a position and turn away, or have loops that hold a
// direction weakly all along. What the constraints demand is right there, and bends faster than a
// polynomial. So the two are compared at every accepted state of the window: where they differ by
// more than the tolerance and what rounding does to the demand, the demand is followed.
#include <deque>
#include <vector>

#include "linkwise/base/outcome.hpp"
#include "linkwise/dynamics/loop_report.hpp"

namespace linkwise {

class Coasting {
 public:
  /// full: what the loops hold elsewhere, as LoopReport::strong; more may be seen on the way.
  /// tolerance: of the integration.
  void start(int full, double tolerance);

  /// Replaces the accelerations dv at time t where the loops are nearly singular, and returns what
  /// becomes of the outcome. remember: of the integration itself; known: they are known already.
  Outcome steer(double t, const LoopReport& loops, Outcome outcome, std::vector<double>& dv,
                bool remember, bool known = false);
  /// Whether that holds.
  bool is_near(const LoopReport& loops) const { return loops.strong < full_; }
  /// Whether the last evaluation of the integration was so.
  bool is_inside() const { return inside_; }
  /// Whether the machine follows what the constraints demand in the window, too.
  bool follows() const { return follows_; }
  /// What is known of accelerations at a state that closes the loops.
  struct Demand {
    const LoopReport& loops;
    double fastest;  ///< rate, rad/s or m/s
    const std::vector<double>& dv;
  };
  /// Whether `other` accelerations there differ by more than rounding errors and tolerance do.
  bool differs(const Demand& demand, const std::vector<double>& other) const;
  /// Looks at an accepted state of the window at time t. beside: accelerations from beside, or
  /// null.
  void compare(double t, const Demand& demand, const std::vector<double>* beside);
  /// How long ago the accelerations before begin, s; infinite: there are too few. 0 after some
  /// steps inside: what is short enough for these will do.
  double reaches_back(double t) const;
  /// The step that the last evaluation belongs to is accepted.
  void accepted();

  /// When the first singular position was passed, roughly; NaN: none was. Steps may jump over one:
  /// pivots, which go to zero there as a parabola does, tell it.
  double passed() const { return passed_; }

 private:
  struct Known {
    double t;
    std::vector<double> dv;
  };

  struct Pivot {
    double t, value;
  };

  double noise(const Demand& demand) const;
  void extrapolate(double t, std::vector<double>& dv) const;
  void find_passage();

  int full_ = 0, rank_ = 0;
  double tolerance_ = 0;
  bool inside_ = false, remembered_ = false, follows_ = false;
  int steps_inside_ = 0, steps_outside_ = 0;
  std::vector<double> expected_;
  Known last_;
  std::deque<Known> known_;
  Pivot last_pivot_{};
  std::deque<Pivot> pivots_;  ///< of the last accepted states
  double passed_ = 0;
};

}  // namespace linkwise
