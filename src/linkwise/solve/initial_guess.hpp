#pragma once
// The start of an iteration within a simulation, from the solutions of earlier times.
//
// A solution at the very time that is asked for (a corrector calls several times at one t) is
// always reused, whatever the kind, except by `zero`, which keeps no history: with it the force is
// a function of time and state alone.

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "linkwise/linear/block_tree.hpp"
#include "linkwise/solve/options.hpp"

namespace linkwise {

class InitialGuess {
 public:
  virtual ~InitialGuess() = default;

  /// Fills x with a guess for the solution of A x = b at time t.
  void predict(double t, const BlockTree& A, std::span<const double> b, std::span<double> x);
  /// Every solution goes here: it is the guess should the same t come again.
  void solved(double t, std::span<const double> x);
  /// The solution of an accepted time. Times must increase; an earlier or equal one drops the
  /// accepted solutions from it on.
  void accept(double t, std::span<const double> x);
  /// Forgets everything: a new run.
  void reset();

 protected:
  struct Sample {
    double t = 0.0;
    std::vector<double> x;
  };

  explicit InitialGuess(int history) : history_(history) {}
  /// Guess from the accepted samples, newest first; there is at least one, all of x's length.
  virtual void extrapolate(double t, const BlockTree& A, std::span<const double> b,
                           std::span<double> x) = 0;
  int count() const { return count_; }
  const Sample& sample(int age) const { return samples_[(newest_ + age) % samples_.size()]; }

 private:
  int history_;
  int count_ = 0, newest_ = 0;
  std::vector<Sample> samples_;
  Sample current_;
  bool has_current_ = false;
};

struct InitialGuessEntry {
  std::string_view name;
  std::string_view description;
  std::string_view reference;  ///< key in references.bib
  std::unique_ptr<InitialGuess> (*make)(const OptionValues&);
  OptionList* options = no_options;
};

std::span<const InitialGuessEntry> initial_guess_table();
/// InputError, listing the known names, when the name is unknown.
std::unique_ptr<InitialGuess> make_initial_guess(std::string_view name,
                                                 const OptionValues& options = {});

}  // namespace linkwise
