#pragma once
// Carries a machine through singular positions, where its loops hold fewer directions than
// elsewhere: a parallelogram stretched straight, for one. Its motion is smooth there, but what the
// constraints demand is a difference of nearly equal numbers over the square of the distance, and
// steps would become smaller without end. In a narrow window around such a position the
// accelerations are those of the polynomial through the last ones before it, or of one through
// positions beside it where these are far apart: see Simulation::accelerate_beside().
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

  /// What is known of accelerations near a singular position beside those of the evaluation.
  struct Aside {
    LoopReport loops;    ///< at the state, once its loops are closed; `strong` is 0: unknown
    double fastest = 0;  ///< rate, rad/s or m/s
    std::vector<double> demand;  ///< what the constraints demand there
    std::vector<double> beside;  ///< by states beside; empty: unknown
  };

  /// Replaces the accelerations dv at time t where the loops are nearly singular, and returns what
  /// becomes of the outcome. remember: of the integration itself.
  Outcome steer(double t, const LoopReport& loops, Outcome outcome, const Aside& aside,
                std::vector<double>& dv, bool remember);
  /// Whether that holds.
  bool is_near(const LoopReport& loops) const { return loops.strong < full_; }
  /// Whether the last evaluation of the integration was so.
  bool is_inside() const { return inside_; }
  /// Whether the machine follows what the constraints demand in the window, too.
  bool follows() const { return follows_; }
  /// Looks at an accepted state of the window at time t.
  void compare(double t, const Aside& aside);
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

  double noise(const Aside& aside) const;
  bool guess(double t, const Aside& aside, std::vector<double>& dv) const;
  bool differs(const Aside& aside, const std::vector<double>& other) const;
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
