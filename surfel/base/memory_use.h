// What the system says of this process's memory.
#pragma once

namespace surflect {

struct MemoryUse {
  double peakBytes = 0;      // the most that was resident, since the process began or forgetPeakMemory()
  double anonymousBytes = 0; // resident now and of no file (RssAnon)
};
MemoryUse memoryUse();

// The peak is counted from now on.
void forgetPeakMemory();

} // namespace surflect
