#include "render/lightfield/lfm/s3tc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

std::vector<uint8_t> throughBlocks(const std::vector<uint8_t>& rgba, size_t width, size_t height) {
  const std::vector<uint8_t> blocks = s3tcBlocks(rgba, width, height);
  EXPECT_EQ(blocks.size(), width * height / 2);
  return s3tcTexels(blocks, width, height);
}

TEST(S3tc, BlocksDecodeByTheRuleOfTheExtension) {
  // Red and blue: two mixtures if the first colour is the larger number; else one, and black.
  const std::vector<uint8_t> four = {0x00, 0xf8, 0x1f, 0x00, 0b11100100, 0, 0, 0};
  const std::vector<uint8_t> four_texels = s3tcTexels(four, 4, 4);
  const std::vector<uint8_t> expected = {255, 0, 0, 255, 0, 0, 255, 255, 170, 0, 85, 255, 85, 0, 170, 255};
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), four_texels.begin()));

  const std::vector<uint8_t> three = {0x1f, 0x00, 0x00, 0xf8, 0b11100100, 0, 0, 0};
  const std::vector<uint8_t> three_texels = s3tcTexels(three, 4, 4);
  const std::vector<uint8_t> black = {0, 0, 255, 255, 255, 0, 0, 255, 128, 0, 128, 255, 0, 0, 0, 0};
  EXPECT_TRUE(std::equal(black.begin(), black.end(), three_texels.begin()));
}

TEST(S3tc, AlphasOfDxt5DecodeByTheRuleOfTheExtension) {
  // Codes 0 to 7, then zeros. Eight mixtures if the first alpha is larger; else six, 0 and 255.
  const std::vector<uint8_t> codes = {0x88, 0xc6, 0xfa, 0, 0, 0};
  const auto alphasOf = [&](uint8_t first, uint8_t second) {
    std::vector<uint8_t> block = {first, second};
    block.insert(block.end(), codes.begin(), codes.end());
    block.insert(block.end(), {0x1f, 0x00, 0x00, 0xf8, 0b11100100, 0, 0, 0});
    return s3tcTexels(block, 4, 4, Blocks::dxt5);
  };
  const std::vector<uint8_t> eight = alphasOf(210, 0), six = alphasOf(0, 200);
  const std::vector<int> eightExpected = {210, 0, 180, 150, 120, 90, 60, 30, 210},
                         sixExpected = {0, 200, 40, 80, 120, 160, 0, 255, 0};
  for (size_t i = 0; i < 9; ++i) {
    EXPECT_EQ(eight[4 * i + 3], eightExpected[i]) << i;
    EXPECT_EQ(six[4 * i + 3], sixExpected[i]) << i;
  }
  // Colours always have two mixtures: blue, red, and two thirds of each.
  const std::vector<uint8_t> colors = {0, 0, 255, 255, 0, 0, 85, 0, 170, 170, 0, 85};
  for (size_t i = 0; i < 12; ++i) EXPECT_EQ(eight[4 * (i / 3) + i % 3], colors[i]) << i;
}

TEST(S3tc, AlphasOfDxt5AreKeptBetterThanColours) {
  std::vector<uint8_t> rgba;
  for (size_t y = 0; y < 16; ++y)
    for (size_t x = 0; x < 16; ++x)
      for (const size_t value : {40 + 6 * x, 200 - 6 * x, 30 + 3 * x, 8 * (x + y)})
        rgba.push_back(static_cast<uint8_t>(value));
  const std::vector<uint8_t> blocks = s3tcBlocks(rgba, 16, 16, Blocks::dxt5);
  EXPECT_EQ(blocks.size(), 16u * 16);
  const std::vector<uint8_t> result = s3tcTexels(blocks, 16, 16, Blocks::dxt5);
  for (size_t i = 0; i < rgba.size(); ++i) EXPECT_LE(std::abs(result[i] - rgba[i]), i % 4 == 3 ? 4 : 6) << i;
}

TEST(S3tc, FlatBlocksAreOffByTwoAtMostAndOpaque) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const uint8_t texel[4] = {static_cast<uint8_t>(random()), static_cast<uint8_t>(random()),
                              static_cast<uint8_t>(random()), static_cast<uint8_t>(random())};
    std::vector<uint8_t> rgba;
    for (int t = 0; t < 16; ++t) rgba.insert(rgba.end(), texel, texel + 4);
    const std::vector<uint8_t> result = throughBlocks(rgba, 4, 4);
    for (size_t c = 0; c < 64; ++c) {
      if (c % 4 == 3)
        EXPECT_EQ(result[c], 255);
      else
        EXPECT_LE(std::abs(result[c] - texel[c % 4]), 2);
    }
  }
}

TEST(S3tc, GradientsBetweenTwoColoursAreOffBySixAtMost) {
  std::vector<uint8_t> rgba;
  for (size_t y = 0; y < 16; ++y)
    for (size_t x = 0; x < 16; ++x)
      for (const size_t value : {40 + 6 * x, 200 - 6 * x, 30 + 3 * x, 8 * (x + y)})
        rgba.push_back(static_cast<uint8_t>(value));
  const std::vector<uint8_t> result = throughBlocks(rgba, 16, 16);
  for (size_t i = 0; i < rgba.size(); ++i)
    if (i % 4 != 3) {
      EXPECT_LE(std::abs(result[i] - rgba[i]), 6) << i;
    }
}

TEST(S3tc, BlocksAreIndependentAndLieRowByRow) {
  std::mt19937 random(2);
  std::vector<uint8_t> rgba(4 * 12 * 8);
  for (uint8_t& byte : rgba) byte = static_cast<uint8_t>(random());
  const std::vector<uint8_t> all = throughBlocks(rgba, 12, 8);
  for (size_t by = 0; by < 8; by += 4)
    for (size_t bx = 0; bx < 12; bx += 4) {
      std::vector<uint8_t> block, expected;
      for (size_t y = by; y < by + 4; ++y) {
        const auto row = static_cast<std::ptrdiff_t>(4 * (12 * y + bx));
        block.insert(block.end(), rgba.begin() + row, rgba.begin() + row + 16);
        expected.insert(expected.end(), all.begin() + row, all.begin() + row + 16);
      }
      EXPECT_EQ(throughBlocks(block, 4, 4), expected);
    }
}

} // namespace
} // namespace surflect::lfm
