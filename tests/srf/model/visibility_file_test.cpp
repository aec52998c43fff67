#include "srf/model/visibility_file.h"

#include "tests/srf/image/files.h"
#include "tests/support/patience.h"

namespace surflect::model {
namespace {

weights::VisibilityWeights randomFades(size_t surfels, size_t views, unsigned seed) {
  std::mt19937 random(seed);
  weights::VisibilityWeights visibility{views, std::vector<uint8_t>(surfels * views)};
  for (uint8_t& fade : visibility.values) fade = static_cast<uint8_t>(random());
  return visibility;
}

TEST(FadeFile, WhatIsPackedIsUnpackedEqual) {
  for (const auto& [surfels, views] :
       {std::pair<size_t, size_t>{0, 0}, {0, 5}, {1, 1}, {1000, 7}, {3, 400}, {20001, 16}, {20001, 33}}) {
    const weights::VisibilityWeights visibility = randomFades(surfels, views, 1);
    const weights::VisibilityWeights unpacked = unpackVisibility(packVisibility(visibility), surfels, views);
    EXPECT_EQ(unpacked.views, views);
    EXPECT_EQ(unpacked.values, visibility.values);
  }
}

TEST(FadeFile, OtherCountsAndEveryTruncationAreRefused) {
  const auto packed = packVisibility(randomFades(50, 4, 2));
  for (const auto& [surfels, views] : {std::pair<size_t, size_t>{50, 3}, {51, 4}, {0, 4}, {50, 0}})
    EXPECT_THROW(unpackVisibility(packed, surfels, views), Error);
  for (size_t length = 0; length < packed.size(); ++length)
    EXPECT_THROW(unpackVisibility(std::span(packed).first(length), 50, 4), Error);
  auto longer = packed;
  longer.push_back(std::byte{0});
  EXPECT_THROW(unpackVisibility(longer, 50, 4), Error);
  const auto wide = packVisibility(randomFades(50, 33, 2));
  for (const size_t views : {16, 32, 34}) EXPECT_THROW(unpackVisibility(wide, 50, views), Error);
}

TEST(FadeFile, AWrongChecksumIsRefused) {
  const auto packed = packVisibility(randomFades(50, 4, 2));
  for (size_t bit = 0; bit < 32; ++bit) {
    auto damaged = packed;
    damaged[packed.size() - 1 - bit / 8] ^= std::byte{1} << bit % 8;
    EXPECT_THROW(unpackVisibility(damaged, 50, 4), Error);
  }
}

TEST(FadeFile, CountsThatTheBytesCannotHoldTakeNoMemory) {
  const auto packed = packVisibility(randomFades(50, 4, 3));
  constexpr size_t huge = size_t{1} << 40;
  for (const auto& [surfels, views] :
       {std::pair<size_t, size_t>{huge, 1}, {1, huge}, {huge, huge}, {~size_t{0}, 2}})
    EXPECT_THROW(unpackVisibility(packed, surfels, views), Error);
}

TEST(FadeFile, BothWaysAskWhetherToGoOn) {
  const weights::VisibilityWeights visibility = randomFades(300000, 5, 4);
  constexpr int endless = std::numeric_limits<int>::max();
  Patience packing(endless), unpacking(endless);
  const auto packed = packVisibility(visibility, packing.progress());
  EXPECT_EQ(unpackVisibility(packed, 300000, 5, unpacking.progress()).values, visibility.values);
  for (const int questions : {0, packing.asks - 1})
    EXPECT_THROW(packVisibility(visibility, Patience(questions).progress()), Cancelled);
  for (const int questions : {0, unpacking.asks - 1})
    EXPECT_THROW(unpackVisibility(packed, 300000, 5, Patience(questions).progress()), Cancelled);
  EXPECT_GE(packing.asks, 6);
  EXPECT_GE(unpacking.asks, 6);
}

} // namespace
} // namespace surflect::model
