#include "linkwise/base/memory.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>

#if defined(__linux__)
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace linkwise {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();

/// The first number of a file of the kernel, after the word `key` where one is given.
double number_in(const char* path, const std::string& key = "") {
  std::ifstream file(path);
  std::string word;
  if (!key.empty())
    while (file >> word && word != key) {
    }
  double value;
  return file >> value ? value : unlimited;
}

std::string amount(double bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g GiB", bytes / (1 << 30));
  return text;
}

}  // namespace

double available_memory() {
  double least = unlimited;
#if defined(__linux__)
  least = 1024 * number_in("/proc/meminfo", "MemAvailable:");
  const double group = number_in("/sys/fs/cgroup/memory.max");
  if (group < unlimited)
    least = std::min(least, group - number_in("/sys/fs/cgroup/memory.current"));
  rlimit limit;
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
    const double used = number_in("/proc/self/statm") * static_cast<double>(sysconf(_SC_PAGESIZE));
    least = std::min(least, static_cast<double>(limit.rlim_cur) - used);
  }
#endif
  return std::max(least, 0.0);
}

void require_memory(double bytes, const std::string& what) {
  if (bytes <= worth_a_check) return;
  const double available = available_memory();
  if (bytes > available)
    throw OutOfMemory(what + " needs about " + amount(bytes) + " of memory, but " +
                      amount(available) + " is available; ask for less at a time");
}

}  // namespace linkwise
