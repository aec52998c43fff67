// A caller that cancels work at a given time.
#pragma once

#include "surfel/base/time.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>

namespace surflect {

// Counts the checkpoints of some work, and cancels it at a given one.
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

// Expects work to have at least `fewestQuestions` checkpoints, and to throw Cancelled at the first, the last
// and three between.
template <class Work> void expectStopsWhenAsked(const Work& work, int fewestQuestions) {
  Patience whole(std::numeric_limits<int>::max());
  work(whole.progress());
  EXPECT_GE(whole.asks, fewestQuestions);
  for (const int questions : {0, 1, whole.asks / 3, whole.asks / 2, whole.asks - 1})
    EXPECT_THROW(work(Patience(questions).progress()), Cancelled);
}

} // namespace surflect
