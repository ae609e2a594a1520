#pragma once

#include <span>

#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

/// r = b - A x, accumulated in twice the working precision and rounded once.
void accurate_residual(const BlockTree& A, std::span<const double> b, std::span<const double> x,
                       std::span<double> r);

}  // namespace linkwise
