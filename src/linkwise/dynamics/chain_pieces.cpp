#include "linkwise/dynamics/chain_pieces.hpp"

#include <algorithm>

namespace linkwise {
namespace {

int ceil_of(int n, int length) { return (n + length - 1) / length; }

}  // namespace

ChainPieces::ChainPieces(int n_bodies, const std::vector<int>& cut_after) {
  std::vector<int> ends = cut_after;
  if (ends.empty() || ends.back() != n_bodies - 1) ends.push_back(n_bodies - 1);
  const int most = std::max(wanted(n_bodies), static_cast<int>(ends.size()));
  const auto needed = [&](int length) {
    int pieces = 0, begin = 0;
    for (const int end : ends) {
      pieces += ceil_of(end + 1 - begin, length);
      begin = end + 1;
    }
    return pieces;
  };
  length_ = ceil_of(n_bodies, most);
  while (needed(length_) > most) ++length_;
  int begin = 0;
  for (const int end : ends) {
    for (; begin <= end; begin = std::min(begin + length_, end + 1)) first_.push_back(begin);
  }
  first_.resize(most + 1, n_bodies);
}

int ChainPieces::ended_by(int body) const {
  return static_cast<int>(std::upper_bound(first_.begin(), first_.end(), body) - first_.begin()) -
         1;
}

int ChainPieces::wanted(int n_bodies) {
  // Eight pieces fill the widest lanes. There are more only if they are long enough to hide the cut
  // system. Its condition grows with the fourth power of their number where hinges are parallel,
  // because across its plane such a chain is a beam: 1024 leave no digit of it.
  int pieces = 8;
  while (pieces < 256 && n_bodies / pieces > 128) pieces *= 2;
  return pieces;
}

}  // namespace linkwise
