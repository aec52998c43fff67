// Processor time of this process.
#pragma once

#include <ctime>

namespace surflect {

// Seconds of all threads together, since the process began.
inline double processorSeconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

} // namespace surflect
