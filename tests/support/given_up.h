// Work that is given up at its first, second, .. checkpoint.
#pragma once

#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>

namespace surflect {

// Calls work(progress) until it ends by itself, each time cancelled at a later checkpoint, and then() after
// each. Expects that it ends exactly if it is not cancelled. Returns how often it was given up.
template <class Work, class Then> size_t giveUpEverywhere(const Work& work, const Then& then) {
  for (size_t given = 0, last = 0;; ++given, last += 1 + last / 3) {
    std::atomic<size_t> calls = 0;
    Progress progress;
    progress.cancelled = [&] { return calls++ >= last; };
    bool isCancelled = false;
    try {
      work(progress);
    } catch (const Cancelled&) {
      isCancelled = true;
    }
    EXPECT_EQ(isCancelled, calls > last);
    then();
    if (!isCancelled) return given;
  }
}

} // namespace surflect
