#include "linkwise/linear/triplets.hpp"

namespace linkwise {
namespace {

void add(Triplets& out, int row, int column, double value) {
  out.row.push_back(row);
  out.column.push_back(column);
  out.value.push_back(value);
}

void add_block(Triplets& out, const BlockTree& A, int i, int j, const Block& block) {
  for (int r = 0; r < A.dim[i]; ++r)
    for (int c = 0; c < A.dim[j]; ++c) {
      const double x = block[block_stride * r + c];
      add(out, A.offset[i] + r, A.offset[j] + c, x);
      if (i != j) add(out, A.offset[j] + c, A.offset[i] + r, x);
    }
}

/// left (rows x 6) times C times right^T (6 x columns), times `factor`.
Block through_body(const Block& left, int rows, const Block& C, const Block& right, int columns,
                   double factor) {
  Block half{}, out{};
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < 6; ++c)
      for (int k = 0; k < 6; ++k)
        half[block_stride * r + c] += left[block_stride * r + k] * C[block_stride * k + c];
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      for (int k = 0; k < 6; ++k)
        out[block_stride * r + c] +=
            factor * half[block_stride * r + k] * right[block_stride * c + k];
  return out;
}

}  // namespace

Triplets triplets_of(const BlockTree& A) {
  Triplets out;
  for (int i = 0; i < A.n(); ++i) {
    add_block(out, A, i, i, A.diag[i]);
    if (A.parent[i] >= 0 && A.lever_of[i] < 0) add_block(out, A, i, A.parent[i], A.parent_block[i]);
  }
  for (const BlockTree::Hub& hub : A.hubs)
    for (int i : hub.children) {
      const Block& H = A.levers[A.lever_of[i]];
      add_block(out, A, i, hub.node,
                through_body(H, A.dim[i], hub.compliance, hub.inboard, A.dim[hub.node], -1));
      for (int s : hub.children)
        if (s < i)
          add_block(
              out, A, i, s,
              through_body(H, A.dim[i], hub.compliance, A.levers[A.lever_of[s]], A.dim[s], 1));
    }
  return out;
}

}  // namespace linkwise
