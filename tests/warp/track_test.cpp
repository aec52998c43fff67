#include "warp/track.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace surflect::warp {
namespace {

ShotTime atFrame(double frame) { return {0, frame, 0}; }

std::vector<Keyframe> randomKeys(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Keyframe> keys;
  double frame = -5;
  for (int i = 0; i < 6; ++i)
    keys.push_back({frame += 0.5 + 10 * uniform(random), uniform(random), i % 2 == 1});
  return keys;
}

TEST(Track, ALiteralIsTheSameAtAllTimes) {
  const Track track = 2.5;
  for (double frame = -10; frame < 10; ++frame) EXPECT_EQ(track.at(atFrame(frame)), 2.5);
}

TEST(Track, GoesThroughItsKeys) {
  std::mt19937 random(1);
  for (int i = 0; i < 100; ++i) {
    const auto keys = randomKeys(random);
    for (const Keyframe& key : keys) EXPECT_EQ(Track::keyframes(keys).at(atFrame(key.frame)), key.value);
  }
}

TEST(Track, EndsHold) {
  std::mt19937 random(2);
  const auto keys = randomKeys(random);
  const Track track = Track::keyframes(keys);
  for (const double away : {1e-9, 1., 1e6}) {
    EXPECT_EQ(track.at(atFrame(keys.front().frame - away)), keys.front().value);
    EXPECT_EQ(track.at(atFrame(keys.back().frame + away)), keys.back().value);
  }
}

TEST(Track, LinearSegmentsAreLinear) {
  const Track track = Track::keyframes({{0, 3}, {4, 11}});
  for (double frame = 0; frame <= 4; frame += 0.125) EXPECT_EQ(track.at(atFrame(frame)), 3 + 2 * frame);
}

TEST(Track, SmoothBelongsToTheSegmentThatArrives) {
  const Track track = Track::keyframes({{1, 0}, {24, 90, true}, {48, 0}});
  EXPECT_DOUBLE_EQ(track.at(atFrame(1 + 23 * 0.25)), 90 * (3 * 0.0625 - 2 * 0.015625));
  EXPECT_DOUBLE_EQ(track.at(atFrame(36)), 45);
}

TEST(Track, SmoothSegmentsStartAndEndAtRest) {
  const Track track = Track::keyframes({{0, -1}, {10, 7, true}});
  const double h = 1e-6;
  EXPECT_LT(std::abs(track.at(atFrame(h)) + 1) / h, 5e-7);
  EXPECT_LT(std::abs(track.at(atFrame(10 - h)) - 7) / h, 5e-7);
}

TEST(Track, ExpressionsKnowTheShotTime) {
  EXPECT_EQ(Track::expression("100*t + 10*frame + s").at({3, 5, 0.5}), 350.5);
}

TEST(Track, RefusesKeysThatAreNoFunctionOfTime) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Track::keyframes({}), Error);
  EXPECT_THROW(Track::keyframes({{1, 0}, {1, 1}}), Error);
  EXPECT_THROW(Track::keyframes({{2, 0}, {1, 1}}), Error);
  EXPECT_THROW(Track::keyframes({{0, inf}}), Error);
  EXPECT_THROW(Track::keyframes({{std::nan(""), 0}}), Error);
  EXPECT_THROW(Track::expression("x"), Error);
}

TEST(FiniteAt, NamesFieldAndFrame) {
  const Track3 track = {1, Track::expression("1/(frame - 7)"), 0};
  EXPECT_EQ(finiteAt(track, atFrame(8), "center"), Vec3<double>(1, 1, 0));
  try {
    finiteAt(track, atFrame(7), "center");
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "center[1]: found inf at frame 7, expected a finite number");
  }
}

TEST(UnitAt, NormalisesWhateverHasALength) {
  for (const double length : {1e-200, 1., 1e200})
    EXPECT_LT((unitAt(Track3{3 * length, 0, -4 * length}, {}, "axis") - Vec3<double>(0.6, 0, -0.8)).norm(),
              3e-16);
  EXPECT_THROW(unitAt(Track3{0, 0, 0}, {}, "axis"), Error);
}

} // namespace
} // namespace surflect::warp
