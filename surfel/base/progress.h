// Progress of long work: reports to the caller, and asks whether to continue.
#pragma once

#include "surfel/base/error.h"

#include <cstddef>
#include <functional>
#include <string_view>

namespace surflect {

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

} // namespace surflect
