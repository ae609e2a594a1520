#pragma once
// A tree of revolute joints cut into paths, the pieces that run side by side in SIMD lanes. Every
// body continues the path of that outboard body whose own subtree is the highest, so that position
// k of a path is a body of height k above its farthest tip, and a path is shorter than the one that
// it ends at: paths taken shortest first, aligned at their tips, find done what they need.
#include <vector>

#include "linkwise/model/model.hpp"

namespace linkwise {

struct Paths {
  struct Path {
    int begin, length;  ///< in `body`
    int parent;         ///< body that it ends at; -1: ground
  };
  /// Bodies of all paths, one after the other, tip first.
  std::vector<int> body;
  /// Shortest first.
  std::vector<Path> path;
  /// Joints of other kinds between the ground and the first revolute ones, as of a floating base.
  std::vector<KindRange> trunk;
  /// What a joint of another kind carries farther out, and all beyond it.
  std::vector<KindRange> outer;

  explicit Paths(const Model& model);

  int body_at(int path_index, int position) const {
    return body[path[path_index].begin + position];
  }
  /// Positions of groups of `lanes` paths, the shortest ones together: sweeps on lanes take as many
  /// steps. The first group may have idle lanes.
  int positions(int lanes) const;
};

/// Do paths side by side pay? Measured (benchmarks/cpp/crossovers.cpp), a position of a group costs
/// what a body costs alone, and a path's way into its lane and out of it three quarters of that.
bool paths_fill(const Model& model, int lanes);

}  // namespace linkwise
