#include "render/lightfield/spherical/image_cache.h"

#include "render/lightfield/spherical/player.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/spherical/slow_disk.h"
#include "tests/render/lightfield/spherical/synthetic_field.h"

#include <algorithm>
#include <atomic>
#include <random>
#include <set>
#include <thread>

namespace surflect::spherical {
namespace {

const FieldShape kShape{4, 8, {}};

// Counts of a budget in images.
CacheSlots slotsOf(size_t memory, size_t gpu) {
  return slotsFor(kShape, {memory * imageBytes(8), gpu * imageBytes(8)}, 2048);
}

FramePlan planFrom(const DirectionTree& tree, const Vec3<double>& from, double detail) {
  return planFrame(tree, windowOf(cameraAt(from, 64), {}), {detail, 0, false, false});
}

TEST(ImageCache, BudgetsAreNeverExceeded) {
  const DirectionTree tree(4);
  VirtualClock clock;
  SlowDisk disk(clock, 0.01);
  CountingTextures textures(clock, 0.001);
  std::mt19937 random(11);
  const CacheSlots slots = slotsOf(30, 40);
  EXPECT_EQ(slots.memory, 30u);
  EXPECT_EQ(slots.gpu, 40u);
  ImageCache cache(slots, disk, textures);
  for (int frame = 0; frame < 100; ++frame) {
    drawAtHand(planFrom(tree, 4 * randomUnit(random), static_cast<double>(random() % 4)), cache, 10,
               [&](auto) { clock.seconds += 0.02; });
    EXPECT_LE(cache.memoryUsed(), slots.memory);
    EXPECT_LE(disk.mostAtOnce(), slots.memory);
    EXPECT_LE(textures.slotsUsed(), slots.gpu);
  }
}

TEST(ImageCache, EveryTriangleHasAnImageWhateverIsMissing) {
  const DirectionTree tree(4);
  VirtualClock clock;
  SlowDisk disk(clock, 10); // nothing arrives in time
  CountingTextures textures(clock, 0);
  ImageCache cache(slotsOf(100, 100), disk, textures);
  const FramePlan plan = planFrom(tree, {0, 1, 4}, 3);
  const FrameCounts counts = drawAtHand(plan, cache, 100, [&](std::span<const TexturedTriangle> drawn) {
    EXPECT_EQ(drawn.size(), plan.triangles.size());
    for (const TexturedTriangle& triangle : drawn) {
      EXPECT_EQ(textures.imageIn(triangle.slot), triangle.image);
      EXPECT_LT(triangle.image, imagesUpTo(0));                                   // level 0
      EXPECT_EQ(triangle.part.pencil.index >> 6, pencilOf(triangle.image).index); // an ancestor
    }
  });
  EXPECT_GT(counts.substituted, 0u);
  EXPECT_EQ(counts.uploads, 0u);
}

TEST(ImageCache, TheNearestAncestorAtHandIsShown) {
  const DirectionTree tree(4);
  VirtualClock clock;
  SlowDisk disk(clock, 0.01);
  CountingTextures textures(clock, 0);
  ImageCache cache(slotsOf(400, 400), disk, textures);
  drawAll(planFrom(tree, {0, 1, 4}, 2), cache, [](auto) {});
  disk.stop();
  drawAtHand(planFrom(tree, {0, 1, 4}, 3), cache, 100, [&](std::span<const TexturedTriangle> drawn) {
    for (const TexturedTriangle& triangle : drawn)
      EXPECT_EQ(triangle.image, imageOf(parentOf(triangle.part.pencil)));
  });
}

TEST(ImageCache, LevelZeroStaysOnTheGpu) {
  const DirectionTree tree(4);
  VirtualClock clock;
  SlowDisk disk(clock, 0.001);
  CountingTextures textures(clock, 0);
  ImageCache cache(slotsOf(30, 25), disk, textures);
  std::mt19937 random(12);
  for (int frame = 0; frame < 50; ++frame) {
    drawAll(planFrom(tree, 4 * randomUnit(random), 3), cache, [](auto) {});
    for (ImageNumber root = 0; root < imagesUpTo(0); ++root) EXPECT_EQ(cache.placeOf(root), Place::gpu);
  }
}

TEST(ImageCache, WhatDoesNotFitIsDrawnInBatchesInTheSameOrder) {
  const DirectionTree tree(4);
  VirtualClock clock;
  const FramePlan plan = planFrom(tree, {3, 1, 3}, 3);
  const auto drawnWith = [&](const CacheSlots& slots, size_t& batches) {
    SlowDisk disk(clock, 0.001);
    CountingTextures textures(clock, 0);
    ImageCache cache(slots, disk, textures);
    std::vector<std::pair<ImageNumber, Vec3<double>>> drawn;
    batches = drawAll(plan, cache, [&](std::span<const TexturedTriangle> triangles) {
                for (const TexturedTriangle& triangle : triangles) {
                  EXPECT_EQ(textures.imageIn(triangle.slot), triangle.image);
                  drawn.emplace_back(triangle.image, triangle.part.corners[0]);
                }
              }).batches;
    return drawn;
  };
  size_t one = 0, many = 0;
  EXPECT_EQ(drawnWith(slotsOf(1000, 1000), one), drawnWith(slotsOf(1, 21), many));
  EXPECT_EQ(one, 1u);
  EXPECT_GT(many, 5u);
}

TEST(ImageCache, BudgetsThatAreTooSmallAreRefusedByName) {
  const auto errorOf = [](const CacheBudgets& budgets) -> std::string {
    try {
      slotsFor(kShape, budgets, 2048);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  const size_t bytes = imageBytes(8);
  EXPECT_EQ(errorOf({bytes, 21 * bytes}), "none");
  EXPECT_NE(errorOf({0, size_t{1} << 30}).find("budget of main memory: found 0.00 MiB"), std::string::npos);
  EXPECT_NE(errorOf({bytes - 1, size_t{1} << 30}).find("budget of main memory"), std::string::npos);
  EXPECT_NE(errorOf({size_t{1} << 30, 20 * bytes}).find("budget of the GPU"), std::string::npos);
  EXPECT_NE(errorOf({size_t{1} << 30, 0}).find("for 21 images"), std::string::npos);
}

TEST(ImageCache, AnImageThatCannotBeReadIsAnErrorAndCanBeAskedForAgain) {
  VirtualClock clock;
  SlowDisk disk(clock, 0.001);
  CountingTextures textures(clock, 0);
  ImageCache cache(slotsOf(30, 30), disk, textures);
  disk.fail(25);
  EXPECT_TRUE(cache.request(25));
  EXPECT_THROW(cache.collect(true), Error);
  EXPECT_EQ(cache.placeOf(25), Place::disk);
  EXPECT_TRUE(cache.request(25));
  cache.collect(true);
  EXPECT_EQ(cache.placeOf(25), Place::memory);
}

// Reads images of any number, and notes by which threads.
class SlowSource : public ImageSource {
public:
  PencilImage read(ImageNumber image) const override {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (image == 13) throw Error("cannot be read").in("level0.tiles");
    return {};
  }
};

TEST(TaskLoader, LoadsEveryImageOnceInTheBackground) {
  const SlowSource source;
  TaskLoader loader(source, 3);
  std::multiset<ImageNumber> expected, found;
  for (ImageNumber image = 0; image < 40; ++image) loader.request(image), expected.insert(image);
  while (found.size() < 40)
    for (const LoadedImage& loaded : loader.finished(true)) {
      found.insert(loaded.number);
      EXPECT_EQ(loaded.image == nullptr, loaded.number == 13);
      EXPECT_EQ(loaded.failure != nullptr, loaded.number == 13);
    }
  EXPECT_EQ(found, expected);
  EXPECT_TRUE(loader.finished(true).empty()); // does not wait for nothing
}

TEST(TaskLoader, EndsWhileImagesAreWaiting) {
  const SlowSource source;
  TaskLoader loader(source, 2);
  for (ImageNumber image = 100; image < 1000; ++image) loader.request(image);
}

} // namespace
} // namespace surflect::spherical
