#include "surfel/base/memory.h"

#include <fstream>
#include <malloc.h>
#include <string>

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

void forgetPeakMemory() {
  malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";
}

} // namespace surflect
