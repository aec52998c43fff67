#include "bench/timing/time_ratio.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace surflect::bench {
namespace {

std::vector<Lap> laps(const std::vector<double>& processorSeconds) {
  std::vector<Lap> result;
  for (const double seconds : processorSeconds) result.push_back({0, seconds});
  return result;
}

// A machine that is slow for a while is so for both.
TEST(TimeRatio, WhatSlowsBothDownIsNotSeen) {
  const TimeRatio ratio = timeRatio(laps({2, 6, 2, 20}), laps({1, 3, 1, 10}));
  EXPECT_DOUBLE_EQ(ratio.median, 2);
  EXPECT_DOUBLE_EQ(ratio.error, 0);
}

TEST(TimeRatio, OneTurnOfManyDoesNotCount) {
  EXPECT_DOUBLE_EQ(timeRatio(laps({3, 3, 90, 3, 3}), laps({1, 1, 1, 1, 1})).median, 3);
}

TEST(TimeRatio, OfOneTurnNoErrorIsKnown) { EXPECT_EQ(timeRatio(laps({3}), laps({2})).error, 0); }

// By what medians of normal ratios really are apart.
TEST(TimeRatio, TheErrorIsThatOfTheMedian) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> gauss(1, 0.1);
  constexpr int kTrials = 2000, kTurns = 25;
  double squares = 0, errors = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> times;
    for (int turn = 0; turn < kTurns; ++turn) times.push_back(gauss(random));
    const TimeRatio ratio = timeRatio(laps(times), laps(std::vector<double>(kTurns, 1)));
    squares += (ratio.median - 1) * (ratio.median - 1) / kTrials;
    errors += ratio.error / kTrials;
  }
  EXPECT_NEAR(errors / std::sqrt(squares), 1, 0.08);
}

} // namespace
} // namespace surflect::bench
