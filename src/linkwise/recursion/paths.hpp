#pragma once
// A tree of revolute joints split into paths, which run side by side in SIMD lanes. Every body
// continues the path of the outboard body with the highest subtree. So the body at position k of a
// path is k above its farthest tip, and a path is shorter than the one that it ends at. Taken
// shortest first and aligned at their tips, paths find done what they need.
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
  /// Bodies on joints of other kinds farther out, and all bodies beyond them.
  std::vector<KindRange> outer;

  explicit Paths(const Model& model);

  int body_at(int path_index, int position) const {
    return body[path[path_index].begin + position];
  }
  /// Sum of the lengths of groups of `lanes` paths, the shortest ones together: the number of steps
  /// of a sweep on lanes. The first group may have idle lanes.
  int positions(int lanes) const;
};

/// Do paths side by side pay? Measured (benchmarks/cpp/crossovers.cpp): a position of a group costs
/// as much as one body alone; taking a path into its lane and out of it costs three quarters of
/// that.
bool paths_fill(const Model& model, int lanes);

}  // namespace linkwise
