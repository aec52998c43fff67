#include "srf/shading/block_lookup.h"

#include "srf/codec/block.h"
#include "tests/support/each_simd.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

namespace surflect::shading {
namespace {

// Jobs of one row, whose blocks have various numbers of terms.
struct Jobs {
  static constexpr uint32_t kLights = 30;
  static constexpr float kBefore = 0.5; // initial value of the sums

  explicit Jobs(size_t count, std::mt19937& random) {
    std::uniform_real_distribution<float> number(-1, 1);
    for (uint32_t light = 0; light < kLights; light += 1 + static_cast<uint32_t>(random() % 3)) {
      weights.push_back({light, number(random)});
      if (random() % 3 == 0) continue; // blended with the next
      const uint32_t begin = row.empty() ? 0 : row.back().end;
      row.push_back(
          {{number(random), number(random), number(random)}, begin, static_cast<uint32_t>(weights.size())});
    }
    for (size_t j = 0; j < count; ++j) {
      const size_t stride = 8 * (random() % 6);
      auto& a = coefficients.emplace_back(kLights * stride);
      auto& e = levels.emplace_back(3 * codec::blockTexels * stride);
      for (float& value : a) value = number(random) / 127;
      for (int8_t& level : e) level = static_cast<int8_t>(random() % 256);
      BlockLookup& job = jobs.emplace_back();
      for (float& weight : job.weights) weight = random() % 3 == 0 ? 0 : number(random);
      const auto step = static_cast<uint32_t>(3 * stride);
      job.right = random() % 2 == 0 ? 0 : step;
      job.down = random() % 2 == 0 ? 0 : codec::blockSize * step;
      job.levels = e.data() + random() % (codec::blockTexels - codec::blockSize - 1) * step;
      job.coefficients = a.data();
      job.stride = static_cast<uint32_t>(stride);
    }
  }

  // Red, green and blue of each of `count` jobs from `first` on.
  std::vector<float> answered(size_t first, size_t count) const {
    std::vector<float> all(4 * count, kBefore), rgb;
    std::vector<BlockLookup> some(jobs.begin() + first, jobs.begin() + first + count);
    for (size_t j = 0; j < count; ++j) some[j].rgb = all.data() + 4 * j;
    lookUp(row.data(), row.size(), weights.data(), some.data(), count);
    for (size_t i = 0; i < all.size(); ++i)
      if (i % 4 != 3) rgb.push_back(all[i]);
    return rgb;
  }

  std::vector<weights::BlendedLight> row;
  std::vector<weights::LightWeight> weights;
  std::vector<std::vector<float>> coefficients;
  std::vector<std::vector<int8_t>> levels;
  std::vector<BlockLookup> jobs;
};

TEST(LookUpKernel, IsTheSumOverLightsTapsAndTerms) {
  std::mt19937 random(6);
  for (int round = 0; round < 40; ++round) {
    const Jobs all(9, random);
    for (const Simd simd : EachSimd()) {
      const std::vector<float> got = all.answered(0, 9);
      for (size_t j = 0; j < 9; ++j)
        for (size_t channel = 0; channel < 3; ++channel) {
          const auto& [levels, coefficients, rgb, stride, right, down, taps] = all.jobs[j];
          double expected = Jobs::kBefore;
          for (size_t k = 0; k < stride; ++k) {
            double folded = 0, texel = 0;
            for (const auto& [color, begin, end] : all.row)
              for (const auto& [light, weight] : std::span(all.weights).subspan(begin, end - begin))
                folded += double{weight} * coefficients[light * stride + k] *
                          std::array{color.r, color.g, color.b}[channel];
            for (size_t t = 0; t < 4; ++t)
              texel += double{taps[t]} * levels[t % 2 * right + t / 2 * down + channel * stride + k];
            expected += folded * texel;
          }
          EXPECT_NEAR(got[3 * j + channel], expected, 5e-6) << nameOf(simd) << ", " << stride;
        }
    }
  }
}

TEST(LookUpKernel, SameBitsWhicheverJobsAreAnsweredTogether) {
  std::mt19937 random(7);
  for (size_t count = 1; count <= 9; ++count) {
    const Jobs all(count, random);
    for ([[maybe_unused]] const Simd simd : EachSimd()) {
      const std::vector<float> together = all.answered(0, count);
      for (size_t j = 0; j < count; ++j)
        EXPECT_EQ(all.answered(j, 1), std::vector(together.begin() + 3 * j, together.begin() + 3 * j + 3));
    }
  }
}

// Many jobs of a row, in few blocks, share their sums over lights.
TEST(LookUpKernel, SameBitsForManyJobsInFewBlocks) {
  std::mt19937 random(9);
  Jobs all(9, random);
  for (size_t j = 0; j < 60; ++j) all.jobs.push_back(all.jobs[random() % 9]);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    const std::vector<float> together = all.answered(0, all.jobs.size());
    for (size_t j = 0; j < all.jobs.size(); ++j)
      EXPECT_EQ(all.answered(j, 1), std::vector(together.begin() + 3 * j, together.begin() + 3 * j + 3));
  }
}

TEST(LookUpKernel, SameBitsForAllVectorInstructionsButScalar) {
  std::mt19937 random(8);
  const Jobs all(9, random);
  for (const Simd simd : EachSimd())
    if (simd != Simd::scalar) {
      EXPECT_EQ(all.answered(0, 9), inSimd(Simd::avx2, [&] { return all.answered(0, 9); }));
    }
}

} // namespace
} // namespace surflect::shading
