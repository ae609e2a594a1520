#pragma once
// A chain divided into pieces. No piece is longer than `length`. Some cuts are asked for: where
// joints that close loops push, a piece ends. The division depends on the chain alone.
#include <vector>

namespace linkwise {

class ChainPieces {
 public:
  /// cut_after: bodies that end a piece, ascending.
  explicit ChainPieces(int n_bodies, const std::vector<int>& cut_after = {});

  /// With empty ones, which fill the last lanes.
  int count() const { return static_cast<int>(first_.size()) - 1; }
  int length() const { return length_; }
  int first(int piece) const { return first_[piece]; }
  int size(int piece) const { return first_[piece + 1] - first_[piece]; }
  /// The body at a position of a piece, or -1.
  int body_at(int piece, int position) const {
    const int n = first_[piece] + position;
    return n < first_[piece + 1] ? n : -1;
  }
  /// The piece that a body ends; -1 of the ground, -1.
  int ended_by(int body) const;

  /// As many as n_bodies bodies are worth.
  static int wanted(int n_bodies);

 private:
  int length_;
  std::vector<int> first_;
};

}  // namespace linkwise
