// A caller who asks work to stop, sooner or later.
#pragma once

#include "surfel/progress.h"

#include <atomic>

namespace surflect {

// Counts how often work asks whether to go on, and says no from some question on.
struct Patience {
  explicit Patience(int questions) : left(questions) {}

  Progress progress() {
    Progress asked;
    asked.cancelled = [this] {
      ++asks;
      return left-- <= 0;
    };
    return asked;
  }

  std::atomic<int> left, asks = 0;
};

} // namespace surflect
