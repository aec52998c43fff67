// A caller that cancels work at a given time.
#pragma once

#include "surfel/base/progress.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>

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

// Work asks at least so often whether to go on, and stops at whichever question is answered with no.
template <class Work> void expectStopsWhenAsked(const Work& work, int fewestQuestions) {
  Patience whole(std::numeric_limits<int>::max());
  work(whole.progress());
  EXPECT_GE(whole.asks, fewestQuestions);
  for (const int questions : {0, 1, whole.asks / 3, whole.asks / 2, whole.asks - 1})
    EXPECT_THROW(work(Patience(questions).progress()), Cancelled);
}

} // namespace surflect
