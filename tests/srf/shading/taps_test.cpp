#include "srf/shading/taps.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace surflect::shading {
namespace {

constexpr int width = 45, height = 30; // pixels; the last blocks extend beyond the image

codec::ViewHeader header() {
  codec::ViewHeader view;
  view.width = width;
  view.height = height;
  return view;
}

// Moments of the taps: the sum of weights, and of weights times texel centres.
struct Moments {
  double weight = 0, x = 0, y = 0;
};

// A stored block is represented by its position.
using Found = std::optional<codec::BlockPosition>;
Moments momentsOf(const ViewTaps<Found>& taps) {
  Moments sum;
  for (const auto& [block, ofBlock] : taps)
    for (int corner = 0; corner < 4; ++corner) {
      const double weight = ofBlock.weights[corner];
      const int texel = ofBlock.texel + corner % 2 * ofBlock.right + corner / 2 * ofBlock.down;
      EXPECT_LT(texel, codec::blockTexels);
      sum.weight += weight;
      sum.x += weight * (block->x * codec::blockSize + texel % codec::blockSize + 0.5);
      sum.y += weight * (block->y * codec::blockSize + texel / codec::blockSize + 0.5);
    }
  return sum;
}

TEST(ViewTaps, OfAnImageWithoutBackgroundAreWhereTheyWereAskedFor) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> anywhereX(0.5f, width - 0.5f), anywhereY(0.5f, height - 0.5f);
  std::set<size_t> counts;
  const auto expectHere = [&](float x, float y) {
    ViewTaps<Found> taps;
    findTaps(
        TexelPosition::at(header(), x, y), [](codec::BlockPosition position) { return Found(position); },
        taps);
    const Moments found = momentsOf(taps);
    EXPECT_NEAR(found.weight, 1, 1.5e-7);
    EXPECT_NEAR(found.x, x, 3e-6) << x << ", " << y;
    EXPECT_NEAR(found.y, y, 3e-6) << x << ", " << y;
    counts.insert(taps.size());
  };
  for (int i = 0; i < 10'000; ++i) expectHere(anywhereX(generator), anywhereY(generator));
  for (int x = 0; x < width; ++x) // at texel centres
    for (int y = 0; y < height; ++y) expectHere(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
  EXPECT_EQ(counts, (std::set<size_t>{1, 2, 4}));
}

TEST(ViewTaps, AskOnlyForBlocksOfTheImage) {
  std::mt19937 generator(2);
  std::uniform_real_distribution<float> around(-20, 70);
  const codec::ViewHeader view = header();
  const auto find = [&](codec::BlockPosition position) {
    EXPECT_GE(position.x, 0);
    EXPECT_GE(position.y, 0);
    EXPECT_LT(position.x, view.blocksAcross());
    EXPECT_LT(position.y, view.blocksDown());
    return Found(position);
  };
  ViewTaps<Found> taps;
  for (int i = 0; i < 10'000; ++i)
    findTaps(TexelPosition::at(view, around(generator), around(generator)), find, taps);
}

// Every second block is background, as on a chessboard.
TEST(ViewTaps, OfTheObjectAloneSumToOne) {
  const auto find = [](codec::BlockPosition position) {
    return (position.x + position.y) % 2 == 0 ? Found(position) : Found();
  };
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> anywhereX(0.5f, width - 0.5f), anywhereY(0.5f, height - 0.5f);
  int empty = 0;
  for (int i = 0; i < 10'000; ++i) {
    const TexelPosition place = TexelPosition::at(header(), anywhereX(generator), anywhereY(generator));
    ViewTaps<Found> taps;
    findTaps(place, find, taps);
    if (taps.empty()) {
      ++empty;
      EXPECT_TRUE(place.isInOneBlock());
      continue;
    }
    EXPECT_NEAR(momentsOf(taps).weight, 1, 1.5e-7);
    for (const auto& [block, ofBlock] : taps) EXPECT_TRUE(find(*block));
  }
  EXPECT_GT(empty, 1000);
}

} // namespace
} // namespace surflect::shading
