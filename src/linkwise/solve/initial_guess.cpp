#include "linkwise/solve/initial_guess.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "linkwise/base/named.hpp"
#include "linkwise/linear/vector.hpp"

namespace linkwise {

void InitialGuess::predict(double t, const BlockTree& A, std::span<const double> b,
                           std::span<double> x) {
  if (has_current_ && current_.t == t && current_.x.size() == x.size()) {
    std::copy(current_.x.begin(), current_.x.end(), x.begin());
  } else if (count_ > 0 && sample(0).x.size() == x.size()) {
    extrapolate(t, A, b, x);
  } else {
    std::fill(x.begin(), x.end(), 0.0);
  }
}

void InitialGuess::solved(double t, std::span<const double> x) {
  if (history_ == 0) return;
  current_.t = t;
  current_.x.assign(x.begin(), x.end());
  has_current_ = true;
}

void InitialGuess::accept(double t, std::span<const double> x) {
  if (history_ == 0) return;
  if (count_ > 0 && sample(0).x.size() != x.size()) reset();
  samples_.resize(history_);
  while (count_ > 0 && sample(0).t >= t) {
    newest_ = (newest_ + 1) % history_;
    --count_;
  }
  newest_ = (newest_ + history_ - 1) % history_;
  count_ = std::min(count_ + 1, history_);
  samples_[newest_].t = t;
  samples_[newest_].x.assign(x.begin(), x.end());
}

void InitialGuess::reset() {
  count_ = newest_ = 0;
  has_current_ = false;
}

namespace {

class Zero final : public InitialGuess {
 public:
  Zero() : InitialGuess(0) {}

 private:
  void extrapolate(double, const BlockTree&, std::span<const double>,
                   std::span<double> x) override {
    std::fill(x.begin(), x.end(), 0.0);
  }
};

/// The polynomial through the last accepted solutions, fewer while there are not enough: Newton's
/// divided differences in Lagrange form, sum_j x_j prod_{i != j} (t - t_i) / (t_j - t_i).
class Polynomial final : public InitialGuess {
 public:
  explicit Polynomial(int degree) : InitialGuess(degree + 1) {}

 private:
  void extrapolate(double t, const BlockTree&, std::span<const double>,
                   std::span<double> x) override {
    std::fill(x.begin(), x.end(), 0.0);
    for (int j = 0; j < count(); ++j) {
      double weight = 1.0;
      for (int i = 0; i < count(); ++i)
        if (i != j) weight *= (t - sample(i).t) / (sample(j).t - sample(i).t);
      add_scaled(weight, sample(j).x, x);
    }
  }
};

/// The best combination of the last solutions in the A-norm [fischer1998]: with the stored
/// solutions made A-orthonormal, v_j, by today's A, x = sum_j (v_j^T b) v_j. The newest comes
/// first, and one that adds nothing beyond rounding is left out. Costs a product with A for each of
/// them.
class Projection final : public InitialGuess {
 public:
  explicit Projection(int history) : InitialGuess(history), basis_(history), image_(history) {}

 private:
  void extrapolate(double, const BlockTree& A, std::span<const double> b,
                   std::span<double> x) override {
    std::fill(x.begin(), x.end(), 0.0);
    int kept = 0;
    for (int age = 0; age < count(); ++age) {
      std::vector<double>&v = basis_[kept], &av = image_[kept];
      v.assign(sample(age).x.begin(), sample(age).x.end());
      av.resize(v.size());
      A.multiply(v, av);
      const double before = dot(v, av);
      for (int pass = 0; pass < 2; ++pass)
        for (int k = 0; k < kept; ++k) {
          const double overlap = dot(image_[k], v);
          add_scaled(-overlap, basis_[k], v);
          add_scaled(-overlap, image_[k], av);
        }
      const double square = dot(v, av);
      if (!(square > 1e-24 * before)) continue;
      const double scale = 1.0 / std::sqrt(square);
      for (double& value : v) value *= scale;
      for (double& value : av) value *= scale;
      add_scaled(dot(v, b), v, x);
      ++kept;
    }
  }

  std::vector<std::vector<double>> basis_, image_;
};

constexpr Option history{.name = "history",
                         .fallback = 8,
                         .text = "solutions kept",
                         .accepts = at_least_one,
                         .wanted = "give 1 or more"};
std::span<const Option> projection_options() { return {&history, 1}; }

constexpr std::array<InitialGuessEntry, 5> table{{
    {"zero", "start from zero; the solution depends on time and state alone", "sharf1993",
     [](const OptionValues&) -> std::unique_ptr<InitialGuess> { return std::make_unique<Zero>(); }},
    {"previous", "the last accepted solution", "sharf1993",
     [](const OptionValues&) -> std::unique_ptr<InitialGuess> {
       return std::make_unique<Polynomial>(0);
     }},
    {"linear", "the line through the last two accepted solutions", "sharf1993",
     [](const OptionValues&) -> std::unique_ptr<InitialGuess> {
       return std::make_unique<Polynomial>(1);
     }},
    {"cubic", "the cubic through the last four accepted solutions", "sharf1993",
     [](const OptionValues&) -> std::unique_ptr<InitialGuess> {
       return std::make_unique<Polynomial>(3);
     }},
    {"projection", "the best combination of the last solutions in the energy norm", "fischer1998",
     [](const OptionValues& options) -> std::unique_ptr<InitialGuess> {
       return std::make_unique<Projection>(options.count(history));
     },
     projection_options},
}};

}  // namespace

std::span<const InitialGuessEntry> initial_guess_table() { return table; }

std::unique_ptr<InitialGuess> make_initial_guess(std::string_view name,
                                                 const OptionValues& options) {
  return find_named("initial guess", name, table).make(options);
}

}  // namespace linkwise
