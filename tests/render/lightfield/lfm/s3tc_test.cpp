#include "render/lightfield/lfm/s3tc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

constexpr S3tcFormat kFormats[] = {S3tcFormat::dxt1, S3tcFormat::dxt5};

std::vector<uint8_t> throughBlocks(const std::vector<uint8_t>& rgba, size_t width, size_t height,
                                   S3tcFormat format, S3tcEffort effort = S3tcEffort::cluster) {
  const std::vector<uint8_t> blocks = s3tcBlocks(rgba, width, height, format, effort);
  EXPECT_EQ(blocks.size(), width * height / 16 * bytesOfBlock(format));
  return s3tcTexels(blocks, width, height, format);
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

  // Alpha 254 and 2, codes 0..7 in the first eight texels.
  const std::vector<uint8_t> alpha = {254, 2, 0x88, 0xc6, 0xfa, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const std::vector<uint8_t> alpha_texels = s3tcTexels(alpha, 4, 4, S3tcFormat::dxt5);
  const std::vector<int> steps = {254, 2, 218, 182, 146, 110, 74, 38};
  for (size_t i = 0; i < 8; ++i) EXPECT_EQ(alpha_texels[4 * i + 3], steps[i]) << i;
  const std::vector<uint8_t> clear = {2, 254, 0x88, 0xc6, 0xfa, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  const std::vector<uint8_t> clear_texels = s3tcTexels(clear, 4, 4, S3tcFormat::dxt5);
  const std::vector<int> clear_steps = {2, 254, 52, 103, 153, 204, 0, 255};
  for (size_t i = 0; i < 8; ++i) EXPECT_EQ(clear_texels[4 * i + 3], clear_steps[i]) << i;
}

TEST(S3tc, FlatBlocksAreOffByTwoAtMostAndAlphaIsExact) {
  std::mt19937 random(1);
  for (const S3tcFormat format : kFormats)
    for (int i = 0; i < 200; ++i) {
      const uint8_t texel[4] = {static_cast<uint8_t>(random()), static_cast<uint8_t>(random()),
                                static_cast<uint8_t>(random()), static_cast<uint8_t>(random())};
      std::vector<uint8_t> rgba;
      for (int t = 0; t < 16; ++t) rgba.insert(rgba.end(), texel, texel + 4);
      const std::vector<uint8_t> result = throughBlocks(rgba, 4, 4, format);
      for (size_t c = 0; c < 64; ++c) {
        if (c % 4 == 3)
          EXPECT_EQ(result[c], format == S3tcFormat::dxt5 ? texel[3] : 255);
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
  for (const S3tcFormat format : kFormats) {
    const std::vector<uint8_t> result = throughBlocks(rgba, 16, 16, format);
    for (size_t i = 0; i < rgba.size(); ++i)
      if (i % 4 != 3) {
        EXPECT_LE(std::abs(result[i] - rgba[i]), 6) << i;
      }
  }
}

TEST(S3tc, MoreEffortHasASmallerError) {
  std::mt19937 random(3);
  std::vector<uint8_t> rgba(4 * 32 * 32);
  for (uint8_t& byte : rgba) byte = static_cast<uint8_t>(random());
  const auto squares = [&](S3tcEffort effort) {
    const std::vector<uint8_t> result = throughBlocks(rgba, 32, 32, S3tcFormat::dxt1, effort);
    double sum = 0;
    for (size_t i = 0; i < rgba.size(); ++i) sum += i % 4 == 3 ? 0 : std::pow(result[i] - rgba[i], 2);
    return sum;
  };
  EXPECT_LT(squares(S3tcEffort::cluster), squares(S3tcEffort::range));
}

TEST(S3tc, BlocksAreIndependentAndLieRowByRow) {
  std::mt19937 random(2);
  std::vector<uint8_t> rgba(4 * 12 * 8);
  for (uint8_t& byte : rgba) byte = static_cast<uint8_t>(random());
  for (const S3tcFormat format : kFormats) {
    const std::vector<uint8_t> all = throughBlocks(rgba, 12, 8, format);
    for (size_t by = 0; by < 8; by += 4)
      for (size_t bx = 0; bx < 12; bx += 4) {
        std::vector<uint8_t> block, expected;
        for (size_t y = by; y < by + 4; ++y) {
          const auto row = static_cast<std::ptrdiff_t>(4 * (12 * y + bx));
          block.insert(block.end(), rgba.begin() + row, rgba.begin() + row + 16);
          expected.insert(expected.end(), all.begin() + row, all.begin() + row + 16);
        }
        EXPECT_EQ(throughBlocks(block, 4, 4, format), expected);
      }
  }
}

} // namespace
} // namespace surflect::lfm
