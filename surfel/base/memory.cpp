#include "surfel/base/memory.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

namespace surflect {

MemoryUse memoryUse() {
  MemoryUse use;
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    double kilobytes = 0;
    if (key == "VmHWM:" && status >> kilobytes) use.peakBytes = 1024 * kilobytes;
    if (key == "RssAnon:" && status >> kilobytes) use.anonymousBytes = 1024 * kilobytes;
  }
  return use;
}

namespace {

// Least memory.max of the process's control group and those around it; `most` if there is none.
uint64_t groupMemory(uint64_t most) {
  std::string line;
  for (std::ifstream groups("/proc/self/cgroup"); std::getline(groups, line);) {
    if (!line.starts_with("0::/")) continue;
    const std::filesystem::path root = "/sys/fs/cgroup";
    for (std::filesystem::path group = root / line.substr(4);; group = group.parent_path()) {
      uint64_t limit = 0;
      if (std::ifstream(group / "memory.max") >> limit) most = std::min(most, limit); // "max" is no number
      if (group == root || !group.has_relative_path()) break;
    }
  }
  return most;
}

} // namespace

uint64_t availableMemory() {
  uint64_t most =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    most = std::min<uint64_t>(most, limit.rlim_cur);
  return groupMemory(most);
}

void requireMemory(double bytes, const std::string& what) {
  const auto available = static_cast<double>(availableMemory());
  if (bytes <= available) return;
  const auto gibibytes = [](double count) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f GiB", count / (1 << 30));
    return std::string(text);
  };
  throw Error("needs " + gibibytes(bytes) + " for " + what + ", but this process may use " +
              gibibytes(available) + " at most");
}

void forgetPeakMemory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

} // namespace surflect
