// Memory of this process, as the system reports it.
#pragma once

namespace surflect {

struct MemoryUse {
  double peakBytes = 0;      // largest resident size since the start or forgetPeakMemory()
  double anonymousBytes = 0; // resident memory that is not mapped from a file (RssAnon)
};
MemoryUse memoryUse();

// Returns memory that was freed to the system, and resets the peak.
void forgetPeakMemory();

} // namespace surflect
