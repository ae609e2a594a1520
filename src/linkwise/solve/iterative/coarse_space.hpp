#pragma once
// A coarse space for a tree cut into pieces: what the pieces' own solves cannot see of each other.
//
// A cut couples the root i of one piece with a node p of another by the block A_ip. With J the
// pieces' part of A and G_i, G_p the diagonal blocks of J^-1 at the two nodes, the singular values
// of
//     W = R_i^T A_ip R_p,   G = R R^T,
// are the cosines of the principal angles, in the A-norm, between the two pieces' responses to
// forces at the cut: near 1 where a force passes the cut freely, which is what makes block Schwarz
// slow. For each singular value above a threshold both pieces' responses J^-1 E_i u and J^-1 E_p v
// join the coarse space, in the manner of spectral coarse spaces [spillane2014], but from the
// matrix alone.

#include <array>
#include <span>
#include <vector>

#include "linkwise/linear/block_tree.hpp"
#include "linkwise/linear/dense_tree.hpp"
#include "linkwise/solve/direct/tree_factor.hpp"

namespace linkwise {

class CoarseSpace {
 public:
  /// Lays out the pieces that `cut` makes of the tree.
  void set_pieces(const BlockTree& A, std::span<const char> cut);
  /// Chooses the vectors and factors the coarse matrix V^T A V; `pieces` holds the factor of J.
  void build(const BlockTree& A, TreeFactor& pieces, double threshold);

  int dimension() const { return static_cast<int>(columns_.size()); }
  /// c = V^T r
  void restrict_all(std::span<const double> r);
  /// c = V^T (r - A z) for z = J^-1 r, when only the cuts' couplings are left of r - A z.
  void restrict_cuts(const BlockTree& A, std::span<const double> z);
  /// c <- (V^T A V)^-1 c; returns the product of both, the square of the correction's A-norm.
  double solve() { return matrix_.solve_in_place(coarse_); }
  /// x += V c
  void prolong_add(std::span<double> x) const;

 private:
  struct Piece {
    int root = -1;
    int parent = -1;  ///< piece towards the base, or -1
    int cut = -1;     ///< the cut towards it
    int size = 0;     ///< scalars
    std::vector<int> nodes, tails;
  };
  struct Cut {
    int piece = -1, root = -1;         ///< the outboard piece and its root
    int parent_piece = -1, tail = -1;  ///< the inboard piece and its node at the cut
  };
  struct Column {
    int node = -1;                  ///< the force acts here
    std::array<double, 6> force{};  ///< R u
    std::size_t begin = 0;          ///< values at the piece's scalars
  };

  void select(const BlockTree& A, const Cut& cut, double threshold);
  void add_column(const BlockTree& A, int piece, int node, const std::array<double, 6>& force,
                  const std::array<std::vector<double>, 6>& responses);
  void respond(const BlockTree& A, TreeFactor& pieces, std::span<const int> nodes,
               std::array<std::vector<double>, 6>& responses);
  const double* value(int column, int node) const {
    return values_.data() + columns_[column].begin + local_[node];
  }
  void reserve();
  void assemble(const BlockTree& A, int piece);
  /// The unknowns of E that belong to a piece; columns_ are numbered alike.
  const std::vector<int>& columns(int piece) const { return matrix_.nodes[piece].unknowns; }

  std::vector<Piece> pieces_;
  DenseTree matrix_;  ///< E = V^T A V, a node per piece
  std::vector<Cut> cuts_;
  std::vector<int> offset_;
  std::vector<int> piece_of_, local_;  ///< per node: piece, first scalar within it
  std::vector<int> forced_;            ///< nodes of the unit forces at work
  std::vector<Column> columns_;
  std::vector<double> values_, coarse_;
  std::array<std::vector<double>, 6> root_responses_, tail_responses_;
};

}  // namespace linkwise
