// The aims that the program's speed is measured by; docs/performance.md says why each is missed that is.
#pragma once

#include "bench/doll_report/doll_report.h"

#include <string>
#include <vector>

namespace surflect::bench {

struct Mark {
  std::string what; // of `value`, with its unit
  double value = 0, mark = 0;
  bool isMost = false; // or the least
  double error = 0;    // that the value may have, where it is known; what it allows is reached
  bool isReached() const { return isMost ? value - error <= mark : value + error >= mark; }
};

// Those that need what this machine or run has not got are left out.
std::vector<Mark> marksOf(const DollMeasurements& measured);

} // namespace surflect::bench
