#include "linkwise/forces/breakpoints.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace linkwise {
namespace {

/// Samples of the integral within an interval between rows: it is a polynomial of degree 4 there,
/// which five points determine.
constexpr int per_interval = 4;
constexpr int nodes = 5;
/// What an action of full size does within this time is the scale of its integral, or within this
/// share of the table, if that is shorter.
constexpr double scale_time = 0.1, scale_share = 0.01;
/// The scale is no more than so many times the whole impulse, so that a hammer's blow of a
/// microsecond, which is nothing beside its own force for a tenth of a second, is not passed over.
constexpr double impulse_share = 10;
/// From so many intervals on, the integral is looked at where the rows are, and not between.
constexpr int enough_rows = 8;
/// The share of the largest action by which it may change from one interval to the next, without
/// a new beginning of the method. Noise of a measured table is less, a pulse more.
constexpr double little = 0.1;
/// A curve goes on through a breakpoint if one polynomial follows it on half of the way to each
/// neighbour, to this many times the tolerance.
constexpr double smooth_slack = 4;

/// The integral of a table's action at all rows and between them.
class Integral {
 public:
  Integral(const Table& table, const TableAction& action, double tolerance);

  int rows() const { return static_cast<int>(t_.size() - 1) / per_interval; }
  double time(int row) const { return t_[row * per_interval]; }
  /// Whether one polynomial follows it from one row to another.
  bool is_one_curve(int first_row, int last_row, double slack = 1) const;
  /// Whether the action before and after this row is nearly the same.
  bool changes_little(int row) const;

 private:
  void append(double t, const double* values) {
    t_.push_back(t);
    values_.insert(values_.end(), values, values + columns_);
  }
  void hold(const double* rate, double width);
  bool are_enough(int first_row, int last_row) const;
  std::array<int, nodes> nodes_between(int first, int last, int stride) const;

  int columns_;
  double largest_ = 0, allowed_ = 0;
  std::vector<double> t_, values_;  ///< [sample], [sample][column]
};

Integral::Integral(const Table& table, const TableAction& action, double tolerance)
    : columns_(table.columns) {
  const size_t intervals = table.breaks.size() - 1, width = static_cast<size_t>(columns_);
  const double first = table.breaks.front(), span = table.breaks.back() - first;
  std::vector<double> value(width), rate(width), sum(width), start(width), at(width), held(width);
  double largest_share = 0, impulse = 0;  // the latter of all columns, each taken as positive
  const auto act_at = [&](double t) {
    table.evaluate(t, value.data());
    table.evaluate(t, rate.data(), 1, true);
    table.evaluate(t, held.data(), 2, true);
    for (size_t c = 0; c < width; ++c) {
      const double share = action.rate * value[c] + action.acceleration * rate[c];
      const double whole =
          action.value * value[c] + action.rate * rate[c] + action.acceleration * held[c];
      largest_ = std::max(largest_, std::abs(whole));
      largest_share = std::max(largest_share, std::abs(share));
      at[c] = action.value * sum[c] + share;
    }
  };
  const auto hold_value = [&] {
    for (size_t c = 0; c < width; ++c) held[c] = action.value * value[c];
    hold(held.data(), span);
  };
  act_at(first);
  if (!action.extended) {
    for (size_t c = 0; c < width; ++c) at[c] -= action.value * value[c] * span;
    append(first - span, at.data());
    hold_value();
  } else {
    append(first, at.data());
  }
  for (size_t i = 0; i < intervals; ++i) {
    const double from = table.breaks[i], length = table.breaks[i + 1] - from;
    const double* row = table.coefficients.data() + i * (table.degree + 1) * width;
    start = sum;
    for (int k = 1; k <= per_interval; ++k) {
      const double x = length * k / per_interval;
      for (size_t c = 0; c < width; ++c) {
        double integral = 0;
        for (int p = 0; p <= table.degree; ++p)
          integral = integral * x + row[p * width + c] / (table.degree - p + 1);
        const double before = sum[c];
        sum[c] = start[c] + integral * x;
        impulse += std::abs(action.value * (sum[c] - before));
      }
      const double t = k == per_interval ? table.breaks[i + 1] : from + x;
      act_at(t);
      append(t, at.data());
    }
  }
  if (!action.extended) hold_value();
  const double time = std::min(scale_time, scale_share * span);
  double scale = largest_ * time;
  if (action.rate == 0 && action.acceleration == 0)
    scale = std::min(scale, impulse_share * impulse);
  scale = std::max(scale, action.least * time);
  largest_ = std::max(largest_, action.least);
  allowed_ = tolerance * (scale + largest_share * scale_time + action.floor);
}

/// Goes on with a constant rate.
void Integral::hold(const double* rate, double width) {
  const double from = t_.back();
  std::vector<double> last(values_.end() - columns_, values_.end()), next(last);
  for (int k = 1; k <= per_interval; ++k) {
    const double x = width * k / per_interval;
    for (int c = 0; c < columns_; ++c) next[c] = last[c] + rate[c] * x;
    append(from + x, next.data());
  }
}

/// Samples near the Chebyshev points, `stride` or a multiple apart.
std::array<int, nodes> Integral::nodes_between(int first, int last, int stride) const {
  constexpr double fractions[nodes] = {0, 0.14644660940672624, 0.5, 0.8535533905932737, 1};
  std::array<int, nodes> out{};
  const auto begin = t_.begin() + first, end = t_.begin() + last;
  for (int k = 0; k < nodes; ++k) {
    const double t = t_[first] + fractions[k] * (t_[last] - t_[first]);
    int near = static_cast<int>(std::lower_bound(begin, end, t) - t_.begin());
    near -= (near - first) % stride;
    out[k] = std::clamp(near, k > 0 ? out[k - 1] + stride : first, last - (nodes - 1 - k) * stride);
  }
  return out;
}

/// Whether rows speak for themselves: many, at like distances. How the table gets from one to the
/// next, on a straight line for one, leaves no trace in the integral at the rows.
bool Integral::are_enough(int first_row, int last_row) const {
  if (last_row - first_row < enough_rows) return false;
  double shortest = time(first_row + 1) - time(first_row), longest = shortest;
  for (int row = first_row + 1; row < last_row; ++row) {
    const double interval = time(row + 1) - time(row);
    shortest = std::min(shortest, interval);
    longest = std::max(longest, interval);
  }
  return longest < 4 * shortest;
}

bool Integral::is_one_curve(int first_row, int last_row, double slack) const {
  if (last_row - first_row < 2) return true;
  const int first = first_row * per_interval, last = last_row * per_interval;
  const int stride = are_enough(first_row, last_row) ? per_interval : 1;
  const std::array<int, nodes> at = nodes_between(first, last, stride);
  const double unit = t_[last] - t_[first];
  std::array<double, nodes> x{}, c{};
  for (int k = 0; k < nodes; ++k) x[k] = (t_[at[k]] - t_[first]) / unit;
  for (int column = 0; column < columns_; ++column) {
    const auto value = [&](int sample) {
      return values_[static_cast<size_t>(sample) * columns_ + column];
    };
    // Newton's divided differences, from the first sample on so that large integrals cancel.
    for (int k = 0; k < nodes; ++k) c[k] = value(at[k]) - value(first);
    for (int order = 1; order < nodes; ++order)
      for (int k = nodes - 1; k >= order; --k) c[k] = (c[k] - c[k - 1]) / (x[k] - x[k - order]);
    for (int s = first + stride; s < last; s += stride) {
      const double here = (t_[s] - t_[first]) / unit;
      double curve = c[nodes - 1];
      for (int k = nodes - 2; k >= 0; --k) curve = curve * (here - x[k]) + c[k];
      if (!(std::abs(value(s) - value(first) - curve) <= slack * allowed_)) return false;
    }
  }
  return true;
}

bool Integral::changes_little(int row) const {
  const size_t n = static_cast<size_t>(columns_), at = static_cast<size_t>(row) * per_interval * n,
               interval = per_interval * n;
  for (size_t c = at; c < at + n; ++c) {
    const double before = (values_[c] - values_[c - interval]) / (time(row) - time(row - 1));
    const double after = (values_[c + interval] - values_[c]) / (time(row + 1) - time(row));
    if (std::abs(after - before) > little * largest_) return false;
  }
  return true;
}

/// The last row up to which one curve goes from this one, by doubling and halving.
int end_of_curve(const Integral& integral, int row) {
  const int rows = integral.rows();
  const int many = row + enough_rows;
  int good = many <= rows && integral.is_one_curve(row, many) ? many : row + 1, bad = rows + 1;
  while (bad > rows && good < rows) {
    const int next = std::min(rows, row + 2 * (good - row));
    (integral.is_one_curve(row, next) ? good : bad) = next;
  }
  while (bad - good > 1 && good < rows) {
    const int middle = good + (bad - good) / 2;
    (integral.is_one_curve(row, middle) ? good : bad) = middle;
  }
  return good;
}

}  // namespace

Breakpoints find_breakpoints(const Table& table, const TableAction& action, double tolerance) {
  const Integral integral(table, action, tolerance);
  const int rows = integral.rows();
  std::vector<int> ends{0};
  while (ends.back() < rows) ends.push_back(end_of_curve(integral, ends.back()));
  const bool action_is_linear = table.degree == 1 || (action.value == 0 && action.rate == 0);
  Breakpoints out;
  for (size_t k = 1; k + 1 < ends.size(); ++k) {
    const double here = integral.time(ends[k]);
    const double reach =
        std::min(here - integral.time(ends[k - 1]), integral.time(ends[k + 1]) - here) / 2;
    int first = ends[k] - 1, last = ends[k] + 1;
    while (first > ends[k - 1] && integral.time(first - 1) >= here - reach) --first;
    while (last < ends[k + 1] && integral.time(last + 1) <= here + reach) ++last;
    out.times.push_back(here);
    // A straight line cannot return to where it was, so that the error test sees what it does.
    const bool straight = action_is_linear && ends[k + 1] - ends[k] == 1;
    using Kind = Breakpoints::Kind;
    out.kinds.push_back(integral.is_one_curve(first, last, smooth_slack) ? Kind::smooth
                        : straight && integral.changes_little(ends[k])   ? Kind::kink
                                                                         : Kind::jump);
  }
  if (action.extended) {  // nothing is known of what follows
    out.times.push_back(integral.time(rows));
    out.kinds.push_back(Breakpoints::Kind::jump);
  }
  return out;
}

}  // namespace linkwise
