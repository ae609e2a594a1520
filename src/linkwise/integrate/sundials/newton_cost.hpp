#pragma once

namespace linkwise::sundials {

/// Up to this many unknowns the Newton matrix is formed by differences, one evaluation per column,
/// and factorised. Above, GMRES needs one evaluation per iteration and no matrix.
constexpr int largest_dense_size = 400;

/// What Newton's linear algebra takes in units of one evaluation of n unknowns. Evaluations take a
/// time that grows as n, factors as n^3, of a matrix of which the rows of the positions are sparse,
/// and solutions as n^2. The two numbers are measured on chains of 2 to 200 links.
constexpr double factor_cost(int n) {
  return n <= largest_dense_size ? static_cast<double>(n) * n / 800.0 : 0.0;
}
constexpr double solution_cost(int n) { return n <= largest_dense_size ? n / 60.0 : 0.0; }

/// Of what a system solves itself by its recursion, estimated from the sweeps that it takes.
constexpr double stiff_factor_cost = 1.0, stiff_solution_cost = 0.5;

}  // namespace linkwise::sundials
