#pragma once
#include <new>
#include <string>

namespace linkwise {

/// Work that would not fit into memory, refused before it starts; MemoryError in Python.
class OutOfMemory : public std::bad_alloc {
 public:
  explicit OutOfMemory(std::string text) : text_(std::move(text)) {}
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  std::string text_;
};

/// Bytes that this process can still use without swapping: what the system, its control group and
/// its own limit leave. Infinite where the system does not tell.
double available_memory();

/// What is smaller is left to the allocator: asking the system takes some 20 us.
inline constexpr double worth_a_check = 1 << 26;

/// OutOfMemory, with the estimate and `what` it is for, where `bytes` more are not available.
void require_memory(double bytes, const std::string& what);

}  // namespace linkwise
