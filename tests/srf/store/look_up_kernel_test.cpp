#include "srf/store/look_up_kernel.h"

#include "srf/store/block.h"
#include "surfel/simd.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace surflect {
namespace {

// Blocks of few terms do not fill the widest instructions.
TEST(LookUpKernel, SameBitsForAnyVectorInstructionsWhateverTheRank) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> number(-1, 1);
  for (size_t stride = 0; stride <= 40; stride += 4)
    for (uint32_t taps = 0; taps <= 4; ++taps) {
      constexpr uint32_t kLights = 30;
      constexpr int kMost = 127;
      std::vector<int8_t> levels(blockTexels * 3 * stride);
      std::vector<float> coefficients(kLights * stride);
      for (int8_t& level : levels) level = static_cast<int8_t>(random() % 256);
      for (float& value : coefficients) value = number(random) / kMost;
      std::vector<LightWeight> row;
      for (uint32_t light = 0; light < kLights; light += 1 + static_cast<uint32_t>(random() % 3))
        row.push_back({light, {number(random), number(random), number(random)}});
      BlockTaps where{};
      for (; where.count < taps; ++where.count) {
        where.weights[where.count] = number(random);
        where.texels[where.count] = static_cast<uint8_t>(random() % blockTexels);
      }
      const LookUpJob job{levels.data(), coefficients.data(), stride, row.data(), row.size()};
      double expected[3] = {};
      for (size_t channel = 0; channel < 3; ++channel)
        for (size_t k = 0; k < stride; ++k) {
          double folded = 0, texel = 0;
          for (const auto& [light, w] : row)
            folded += double{coefficients[light * stride + k]} * std::array{w.r, w.g, w.b}[channel];
          for (uint32_t t = 0; t < taps; ++t)
            texel += double{where.weights[t]} * levels[(3 * where.texels[t] + channel) * stride + k];
          expected[channel] += folded * texel;
        }
      std::array<float, 3> plain;
      lookUpKernel(Simd::scalar)(job, where, plain.data());
      for (size_t channel = 0; channel < 3; ++channel) EXPECT_NEAR(plain[channel], expected[channel], 2e-5);
      for (const Simd simd : supportedSimd()) {
        std::array<float, 3> got;
        lookUpKernel(simd)(job, where, got.data());
        EXPECT_EQ(got, plain) << nameOf(simd) << ", " << stride;
      }
    }
}

} // namespace
} // namespace surflect
