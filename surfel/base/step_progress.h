// Progress of work in several steps.
#pragma once

#include "surfel/base/progress.h"

namespace surflect {

// Progress for step i of n: its reports are scaled to that part of the stage. `whole` must outlive it.
inline Progress stepOf(const Progress& whole, std::string_view stage, size_t i, size_t n) {
  Progress step = whole;
  if (whole.report)
    step.report = [&whole, stage, i, n](std::string_view, double fraction) {
      whole.report(stage, (static_cast<double>(i) + fraction) / static_cast<double>(n));
    };
  return step;
}

} // namespace surflect
