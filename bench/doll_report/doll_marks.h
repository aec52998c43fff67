// The aims that the program's speed is measured by; docs/performance.md says why each is missed that is.
#pragma once

#include "bench/doll_report/doll_report.h"

#include <string>
#include <vector>

namespace surflect {

struct Mark {
  std::string what; // of `value`, with its unit
  double value = 0, mark = 0;
  bool isMost = false; // or the least
  bool isReached() const { return isMost ? value <= mark : value >= mark; }
};

// Those that need what this machine or run has not got are left out.
std::vector<Mark> marksOf(const DollMeasurements& measured);

} // namespace surflect
