#include "render/lightfield/slf/texture_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <set>
#include <vector>

namespace surflect::slf {
namespace {

constexpr std::array kPolicies{CachePolicy::lru, CachePolicy::modifiedLru, CachePolicy::planned};

std::vector<uint32_t> upTo(uint32_t count) {
  std::vector<uint32_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0u);
  return numbers;
}

// Hits of a frame that asks for textures one after the other.
size_t hitsOf(TextureCache& cache, const std::vector<uint32_t>& textures) {
  const size_t before = cache.counts().hits;
  cache.beginFrame(textures);
  for (const uint32_t texture : textures) cache.place({&texture, 1});
  return cache.counts().hits - before;
}

TEST(TextureCache, AHitIsTheTextureThatWasPutThereLast) {
  for (const CachePolicy policy : kPolicies)
    for (const size_t groupSize : {1, 3, 5}) {
      std::mt19937 random(static_cast<unsigned>(groupSize));
      for (const size_t slots : {groupSize, groupSize + 1, size_t{12}, size_t{40}}) {
        constexpr uint32_t kTextures = 30;
        TextureCache cache(policy, slots, groupSize, kTextures);
        std::vector<uint32_t> content(slots, kTextures); // as the caller has filled it
        for (int frame = 0; frame < 20; ++frame) {
          std::vector<uint32_t> needed = upTo(kTextures);
          std::ranges::shuffle(needed, random);
          needed.resize(random() % kTextures);
          cache.beginFrame(needed);
          for (size_t first = 0; first < needed.size(); first += groupSize) {
            const auto group = std::span(needed).subspan(first, std::min(groupSize, needed.size() - first));
            const auto places = cache.place(group);
            ASSERT_EQ(places.size(), group.size());
            for (size_t i = 0; i < group.size(); ++i) {
              ASSERT_LT(places[i].slot, slots);
              if (places[i].isHit) {
                ASSERT_EQ(content[places[i].slot], group[i]);
              }
              content[places[i].slot] = group[i];
            }
            // All of the group are there at once.
            for (size_t i = 0; i < group.size(); ++i) ASSERT_EQ(content[places[i].slot], group[i]);
          }
        }
      }
    }
}

TEST(TextureCache, AFrameThatFitsIsAllHitsTheNextTime) {
  for (const CachePolicy policy : kPolicies) {
    const std::vector<uint32_t> frame = upTo(20);
    TextureCache cache(policy, 21, 1, 100);
    EXPECT_EQ(hitsOf(cache, frame), 0u);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(hitsOf(cache, frame), 20u);
  }
}

// The cascade of misses of [Azuma 1999, §3.3].
TEST(TextureCache, PlainLruFindsNothingOfAFrameThatIsOneTextureTooLarge) {
  const std::vector<uint32_t> frame = upTo(20);
  TextureCache cache(CachePolicy::lru, 19, 1, 20);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(hitsOf(cache, frame), 0u);
}

TEST(TextureCache, TheOthersFindAsMuchAsFits) {
  const std::vector<uint32_t> frame = upTo(20);
  for (const CachePolicy policy : {CachePolicy::modifiedLru, CachePolicy::planned})
    for (const size_t slots : {2, 5, 11, 19}) {
      TextureCache cache(policy, slots, 1, 20);
      hitsOf(cache, frame);
      // All slots but the shared one, whose last texture is not asked for soon enough.
      for (int i = 0; i < 4; ++i) EXPECT_EQ(hitsOf(cache, frame), slots - 1);
    }
}

// Views that move: textures leave the frame at one end and enter at the other.
size_t hitsOfWalk(CachePolicy policy, size_t slots, int step) {
  TextureCache cache(policy, slots, 1, 200);
  size_t hits = 0;
  for (int frame = 0; frame < 30; ++frame) {
    std::vector<uint32_t> needed;
    for (int i = 0; i < 40; ++i) needed.push_back(static_cast<uint32_t>((frame * step + i) % 200));
    std::ranges::sort(needed); // passes come in ascending order
    hits += hitsOf(cache, needed);
  }
  return hits;
}

TEST(TextureCache, PlannedReplacesOnlyWhatAFrameDoesNotNeed) {
  EXPECT_EQ(hitsOfWalk(CachePolicy::planned, 41, 5), 29u * 35u);
  for (const size_t slots : {10, 20, 41})
    EXPECT_GE(hitsOfWalk(CachePolicy::planned, slots, 5), hitsOfWalk(CachePolicy::modifiedLru, slots, 5));
}

TEST(TextureCache, HitsAndMissesCountEveryRequest) {
  for (const CachePolicy policy : kPolicies) {
    TextureCache cache(policy, 7, 2, 20);
    for (int i = 0; i < 3; ++i) hitsOf(cache, upTo(20));
    EXPECT_EQ(cache.counts().hits + cache.counts().misses, 60u);
  }
}

} // namespace
} // namespace surflect::slf
