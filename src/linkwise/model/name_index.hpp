#pragma once
// Which element has a name. It is a hash table of indices alone, some ten bytes per name, because
// the names themselves are kept elsewhere.
#include <bit>
#include <functional>
#include <string_view>
#include <vector>

namespace linkwise {

class NameIndex {
 public:
  /// Forgets everything and makes room for n names.
  void reset(size_t n) { slots_.assign(std::bit_ceil(2 * n + 1), -1); }

  /// Adds element i, one of at most n; name_of(i) is its name. False where the name is taken.
  template <class NameOf>
  bool insert(int i, NameOf&& name_of) {
    int& slot = slots_[slot_of(name_of(i), name_of)];
    if (slot >= 0) return false;
    slot = i;
    return true;
  }

  /// The element of that name, or -1.
  template <class NameOf>
  int find(std::string_view name, NameOf&& name_of) const {
    return slots_.empty() ? -1 : slots_[slot_of(name, name_of)];
  }

 private:
  /// Where the name is or belongs: half of the slots are empty, so that the search ends.
  template <class NameOf>
  size_t slot_of(std::string_view name, NameOf&& name_of) const {
    const size_t mask = slots_.size() - 1;
    size_t at = std::hash<std::string_view>{}(name)&mask;
    while (slots_[at] >= 0 && name_of(slots_[at]) != name) at = (at + 1) & mask;
    return at;
  }

  std::vector<int> slots_;
};

}  // namespace linkwise
