#include "render/lightfield/common/pull_push.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace surflect::lightfield {
namespace {

using Texels = std::vector<Eigen::Vector4f>;

constexpr std::array<std::array<int, 2>, 5> kSizes{{{1, 1}, {16, 16}, {13, 7}, {1, 9}, {31, 2}}};

Texels randomTexels(std::mt19937& random, int width, int height, double observed) {
  std::uniform_real_distribution<float> value(0, 1);
  Texels texels(static_cast<size_t>(width) * height);
  for (auto& texel : texels) {
    texel << value(random), value(random), value(random), 0;
    if (value(random) < observed) texel[3] = value(random) < 0.5f ? 1 : value(random);
  }
  return texels;
}

TEST(PullPush, KeepsTheBitsOfObservedTexelsAndAllWeights) {
  std::mt19937 random(1);
  for (const auto& [width, height] : kSizes) {
    const Texels before = randomTexels(random, width, height, 0.4);
    Texels after = before;
    pullPush(after, width, height);
    for (size_t i = 0; i < before.size(); ++i) {
      EXPECT_EQ(after[i][3], before[i][3]);
      if (before[i][3] == 1) {
        EXPECT_EQ(after[i], before[i]);
      }
    }
  }
}

TEST(PullPush, FillsWithTheOnlyColourThatWasObserved) {
  const Eigen::Vector4f color(0.25f, 3, 1000, 0);
  for (const float weight : {1.f, 0.3f, 1e-6f})
    for (const auto& [width, height] : kSizes) {
      Texels texels(static_cast<size_t>(width) * height, Eigen::Vector4f(7, 7, 7, 0));
      texels[texels.size() / 3] << color.head<3>(), weight;
      pullPush(texels, width, height);
      for (const auto& texel : texels)
        EXPECT_LE((texel - color).head<3>().norm(), 1e-6f * color.norm()) << width << ' ' << height;
    }
}

TEST(PullPush, StaysBetweenTheObservedColours) {
  std::mt19937 random(2);
  for (const auto& [width, height] : kSizes) {
    Texels texels = randomTexels(random, width, height, 0.1);
    texels[0][3] = 1;
    Eigen::Array3f low = texels[0].head<3>(), high = low;
    for (const auto& texel : texels)
      if (texel[3] > 0) low = low.min(texel.head<3>().array()), high = high.max(texel.head<3>().array());
    pullPush(texels, width, height);
    for (const auto& texel : texels) {
      EXPECT_TRUE((texel.head<3>().array() >= low - 1e-6f).all());
      EXPECT_TRUE((texel.head<3>().array() <= high + 1e-6f).all());
    }
  }
}

TEST(PullPush, DoesNotReadColoursThatWereNotObserved) {
  std::mt19937 random(3);
  Texels some = randomTexels(random, 13, 7, 0.3), others = some;
  for (auto& texel : others)
    if (texel[3] == 0) texel.head<3>().setConstant(std::numeric_limits<float>::quiet_NaN());
  pullPush(some, 13, 7);
  pullPush(others, 13, 7);
  EXPECT_EQ(some, others);
}

TEST(PullPush, GivesBlackIfNothingWasObserved) {
  for (const auto& [width, height] : kSizes) {
    Texels texels(static_cast<size_t>(width) * height,
                  Eigen::Vector4f(1, std::numeric_limits<float>::quiet_NaN(), 3, 0));
    pullPush(texels, width, height);
    for (const auto& texel : texels) EXPECT_EQ(texel, Eigen::Vector4f(0, 0, 0, 0));
  }
}

TEST(PullPush, CommutesWithMirroring) {
  std::mt19937 random(4);
  constexpr int kSide = 16;
  Texels texels = randomTexels(random, kSide, kSide, 0.2), mirrored = texels;
  const auto mirror = [](Texels& t) {
    for (int y = 0; y < kSide; ++y) std::reverse(t.begin() + y * kSide, t.begin() + (y + 1) * kSide);
  };
  mirror(mirrored);
  pullPush(texels, kSide, kSide);
  pullPush(mirrored, kSide, kSide);
  mirror(mirrored);
  for (size_t i = 0; i < texels.size(); ++i) EXPECT_LE((texels[i] - mirrored[i]).norm(), 1e-6f);
}

TEST(PullPush, FillsAHoleSmoothly) {
  constexpr int kSide = 64;
  Texels texels(kSide * kSide);
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      texels[y * kSide + x] << (x < kSide / 2 ? 0.f : 1.f), 0, 0, (x == 0 || x == kSide - 1 ? 1.f : 0.f);
  pullPush(texels, kSide, kSide);
  float largest = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 1; x < kSide; ++x)
      largest = std::max(largest, std::abs(texels[y * kSide + x][0] - texels[y * kSide + x - 1][0]));
  EXPECT_LE(largest, 0.1f); // 0.5 by nearest texels
}

} // namespace
} // namespace surflect::lightfield
