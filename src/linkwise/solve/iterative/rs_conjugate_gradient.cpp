// Conjugate gradients on the reduced system (RS-CG of [hageman1981], chapter 8).
//
// Red nodes do not couple with each other, so they are eliminated exactly: on A~ with unit diagonal
//     S x_B = b_B - A_BR b_R,   S = A_BB - A_BR A_RB,   x_R = b_R - A_RB x_B.
// Along a chain S = 1 - A_BR A_RB has the eigenvalues 1 - mu^2 where A~ has 1 - mu and 1 + mu,
// which halves the iterations, and a product with S costs no more than one with A~. With hubs S
// keeps the couplings of the nodes that are not red.

#include <algorithm>

#include "linkwise/solve/iterative/iterative_solver.hpp"
#include "linkwise/solve/iterative/krylov.hpp"

namespace linkwise {
namespace {

class ReducedConjugateGradient final : public IterativeSolver {
 public:
  explicit ReducedConjugateGradient(const SolverOptions& options)
      : IterativeSolver(options, Coordinates::block_scaled) {}

 private:
  static constexpr char red = 0, black = 1;

  Outcome prepare(const BlockTree&) override {
    if (!scaled().structure_changed()) return Outcome::converged;
    scaled().colour(colours_);
    colour_.resize(colours_.size());
    for (std::size_t i = 0; i < colours_.size(); ++i) colour_[i] = colours_[i] == 0 ? red : black;
    for (std::vector<double>* v : {&right_, &argument_}) v->resize(scaled().size());
    return Outcome::converged;
  }

  void clear(char colour, std::span<double> v) const {
    for (int i = 0; i < scaled().n(); ++i)
      if (colour_[i] == colour) std::fill_n(v.data() + scaled().offset[i], scaled().dim[i], 0.0);
  }

  void negate(char colour, std::span<double> v) const {
    for (int i = 0; i < scaled().n(); ++i)
      if (colour_[i] == colour)
        for (int k = scaled().offset[i]; k < scaled().offset[i + 1]; ++k) v[k] = -v[k];
  }

  /// w = S v on black nodes, zero on red ones; v is zero on red nodes.
  void multiply_reduced(std::span<const double> v, std::span<double> w) {
    std::copy(v.begin(), v.end(), argument_.begin());
    scaled().add_coupling(v, argument_, colour_, red);
    negate(red, argument_);
    std::copy(v.begin(), v.end(), w.begin());
    scaled().add_coupling(argument_, w, colour_, black);
  }

  void iterate(std::span<const double> b, std::span<double> x, StopTest& stop) override;

  KrylovVectors work_;
  std::vector<int> colours_;
  std::vector<char> colour_;
  std::vector<double> right_, argument_;
};

void ReducedConjugateGradient::iterate(std::span<const double> b, std::span<double> x,
                                       StopTest& stop) {
  std::copy(b.begin(), b.end(), argument_.begin());
  clear(black, argument_);
  // ||x*||_A^2 = b_R^T b_R + (the energy of the reduced solution).
  const double red_energy = sum_of_squares(argument_, executor());
  std::fill(right_.begin(), right_.end(), 0.0);
  scaled().add_coupling(argument_, right_, colour_, black);
  subtract_from(b, right_, executor());
  clear(red, right_);
  clear(red, x);
  conjugate_gradients(
      right_, x, stop, work_,
      [this](std::span<const double> v, std::span<double> w) { multiply_reduced(v, w); },
      [](std::span<const double> r, std::span<double>) { return r; }, executor(), red_energy);
  std::copy(x.begin(), x.end(), argument_.begin());
  scaled().add_coupling(argument_, x, colour_, red);
  negate(red, x);
  for (int i = 0; i < scaled().n(); ++i)
    if (colour_[i] == red)
      for (int k = scaled().offset[i]; k < scaled().offset[i + 1]; ++k) x[k] += b[k];
}

}  // namespace

std::unique_ptr<LinearSolver> make_rs_conjugate_gradient(const SolverOptions& options) {
  return std::make_unique<ReducedConjugateGradient>(options);
}

}  // namespace linkwise
