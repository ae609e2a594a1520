#pragma once
// A block forest with a border, the symmetric positive definite system
//     [ F  C^T ] [ x ]   [ b ]
//     [ C   E  ] [ y ] = [ c ].
// A border row couples a few nodes of the forest, as a loop's constraint couples the joints at its
// two bodies; border rows may all couple with each other. Vectors hold the forest's unknowns first,
// then the border's.

#include <array>
#include <span>
#include <vector>

#include "linkwise/linear/block_tree.hpp"

namespace linkwise {

struct BorderedSystem {
  struct Coupling {
    int node;                                ///< of the forest
    std::array<double, block_stride> row{};  ///< dim[node] entries of C
  };

  BlockTree forest;
  std::vector<std::vector<Coupling>> border;  ///< C, per border row
  std::vector<double> corner;                 ///< E, full and symmetric, width x width

  int width() const { return static_cast<int>(border.size()); }
  int size() const { return forest.size() + width(); }

  /// Lays out the border's structure: the nodes that each row couples. Numbers are zero.
  void set_border(std::span<const std::vector<int>> nodes_of_row);

  /// Row k of C times x.
  double border_product(int k, std::span<const double> x) const;
  /// y += factor times row k of C, transposed.
  void add_border_row(int k, double factor, std::span<double> y) const;
  /// y = A x. x and y must not overlap.
  void multiply(std::span<const double> x, std::span<double> y) const;
};

}  // namespace linkwise
