#include "srf/capture/matte_vote.h"

#include "tests/srf/image/files.h"

#include <algorithm>
#include <limits>
#include <random>

namespace surflect::capture {
namespace {

image::Image matte(std::initializer_list<float> values) {
  image::Image alpha(static_cast<int>(values.size()), 1, 1);
  std::ranges::copy(values, alpha.values.begin());
  return alpha;
}

std::vector<float> outcome(const std::vector<image::Image>& mattes) {
  MatteVote vote(mattes.size());
  for (const image::Image& alpha : mattes) vote.add(alpha);
  return vote.outcome().values;
}

TEST(MatteVotes, OfLikeMattesAreThatMatte) {
  const image::Image alpha = image::randomImage(9, 7, 1, 0, 1, 1);
  for (const size_t count : {1u, 2u, 7u, 8u, 16u, 40u})
    EXPECT_EQ(outcome(std::vector(count, alpha)), alpha.values) << count;
}

TEST(MatteVotes, EqualSortedRanksInAnyOrder) {
  std::mt19937 random(2);
  for (const size_t count : {1u, 3u, 8u, 15u, 16u, 33u}) {
    std::vector<image::Image> mattes;
    for (size_t i = 0; i < count; ++i)
      mattes.push_back(image::randomImage(20, 20, 1, 0, 1, static_cast<unsigned>(100 * count + i)));
    const std::vector<float> first = outcome(mattes);
    for (size_t texel = 0; texel < first.size(); ++texel) {
      std::vector<float> values;
      for (const image::Image& alpha : mattes) values.push_back(alpha.values[texel]);
      std::ranges::sort(values, std::ranges::greater());
      EXPECT_EQ(first[texel], values[std::max<size_t>(1, count / 8) - 1]);
    }
    std::ranges::shuffle(mattes, random);
    EXPECT_EQ(outcome(mattes), first);
  }
}

TEST(MatteVotes, LeaveOutEmptyAndFullMattes) {
  const image::Image object = matte({0, 0.6f, 1, 0}), empty = matte({0, 0, 0.4f, 0}),
                     full = matte({1, 1, 1, 1});
  EXPECT_EQ(outcome({empty, object, full, empty, full}), object.values);
  EXPECT_EQ(outcome({empty, full, empty}), full.values);
  EXPECT_EQ(outcome({empty, matte({0.2f, 0, 0, 0})}), matte({0.2f, 0, 0.4f, 0}).values);
  EXPECT_TRUE(outcome({}).empty());
}

TEST(MatteVotes, OfThresholdsUniteWhatSomeLightsShow) {
  std::vector<image::Image> mattes;
  for (size_t i = 0; i < 16; ++i)
    mattes.push_back(matte({i < 2 ? 1.f : 0, i >= 2 ? 1.f : 0, i == 2 ? 1.f : 0, 0}));
  EXPECT_EQ(outcome(mattes), matte({1, 1, 0, 0}).values); // one of 16 alone is an outlier
}

TEST(SettledAlpha, IsClearOrOpaqueWithinAFew255ths) {
  for (const int code : {0, 1, 2, 3}) EXPECT_EQ(settledAlpha(static_cast<float>(code) / 255), 0) << code;
  for (const int code : {254, 255}) EXPECT_EQ(settledAlpha(static_cast<float>(code) / 255), 1) << code;
  for (const int code : {4, 128, 253}) {
    const float alpha = static_cast<float>(code) / 255;
    EXPECT_EQ(settledAlpha(alpha), alpha);
  }
  EXPECT_EQ(settledAlpha(std::numeric_limits<float>::quiet_NaN()), 0);
}

} // namespace
} // namespace surflect::capture
