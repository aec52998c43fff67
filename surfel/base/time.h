// Progress of long work, and the time it takes.
#pragma once

#include "surfel/base/error.h"

#include <chrono>
#include <cstddef>
#include <ctime>
#include <functional>
#include <string_view>

namespace surflect {

// Progress of long work: reports to the caller, and asks whether to continue.
struct Progress {
  // Called with the name of the stage and the fraction done, 0..1, from any thread, one at a time.
  std::function<void(std::string_view stage, double fraction)> report;
  // Returns whether to stop; called from any thread at any time.
  std::function<bool()> cancelled;

  // Throws Cancelled if the caller has requested it.
  void checkpoint() const {
    if (cancelled && cancelled()) throw Cancelled();
  }
  // Checkpoint for loops of small steps over index i.
  void checkNowAndThen(size_t i) const {
    if (i % 1024 == 0) checkpoint();
  }
  void operator()(std::string_view stage, double fraction) const {
    checkpoint();
    if (report) report(stage, fraction);
  }
};

// Progress of work in several steps.

// Progress for step i of n: its reports are scaled to that part of the stage. `whole` must outlive it.
inline Progress stepOf(const Progress& whole, std::string_view stage, size_t i, size_t n) {
  Progress step = whole;
  if (whole.report)
    step.report = [&whole, stage, i, n](std::string_view, double fraction) {
      whole.report(stage, (static_cast<double>(i) + fraction) / static_cast<double>(n));
    };
  return step;
}

// Elapsed wall-clock time.

// Starts at construction.
class Stopwatch {
public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

// Processor time of this process.

// Seconds of all threads together, since the process began.
inline double processorSeconds() {
  timespec time{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

} // namespace surflect
