// How long work talks to its caller: it reports how far it is and asks whether to go on.
#pragma once

#include "surfel/base/error.h"

#include <cstddef>
#include <functional>
#include <string_view>

namespace surflect {

struct Progress {
  // Called with the name of the stage and the fraction done, 0..1; may be called from any thread, one at a
  // time.
  std::function<void(std::string_view stage, double fraction)> report;
  // May be called from any thread at any time.
  std::function<bool()> cancelled;

  // Throws Cancelled when the caller has asked to stop.
  void checkpoint() const {
    if (cancelled && cancelled()) throw Cancelled();
  }
  // For loops of small steps, over index i.
  void checkNowAndThen(size_t i) const {
    if (i % 1024 == 0) checkpoint();
  }
  void operator()(std::string_view stage, double fraction) const {
    checkpoint();
    if (report) report(stage, fraction);
  }
};

} // namespace surflect
