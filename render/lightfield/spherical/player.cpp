#include "render/lightfield/spherical/player.h"

#include <cassert>
#include <optional>
#include <unordered_set>
#include <utility>
#include <vector>

namespace surflect::spherical {

FramePlan planFrame(const DirectionTree& tree, const Window& window, const Look& look,
                    const Progress& progress) {
  FramePlan plan;
  for (const LevelShare& share : levelShares(look.detail, tree.levels()))
    for (const Pencil& pencil : visiblePencils(tree, share.level, window, progress)) {
      progress.checkpoint();
      appendTriangles(tree, pencil, share.weight, look.interpolated, plan.triangles);
    }
  std::unordered_set<ImageNumber> known;
  for (const WeightedTriangle& triangle : plan.triangles)
    if (const ImageNumber image = imageOf(triangle.pencil); known.insert(image).second)
      plan.images.push_back(image);
  return plan;
}

namespace {

// Brings an image to the GPU, whatever it takes but to replace what is in use. Returns whether it is there.
bool fetch(ImageNumber image, ImageCache& cache, FrameCounts& counts, const Progress& progress) {
  bool isCounted = false;
  while (cache.placeOf(image) != Place::gpu) {
    progress.checkpoint();
    if (cache.placeOf(image) == Place::memory) {
      if (!cache.upload(image)) return false;
      ++counts.uploads;
      break;
    }
    if (!isCounted) ++counts.reads, isCounted = true;
    if (!cache.request(image)) cache.releaseMemory();
    cache.collect(true); // without room, one that is on its way arrives first
  }
  return true;
}

// Requests images ahead of their use, as many as fit.
void requestAhead(std::span<const ImageNumber> images, ImageCache& cache) {
  for (const ImageNumber image : images)
    if (cache.placeOf(image) == Place::disk && !cache.request(image)) return;
}

} // namespace

FrameCounts drawAll(const FramePlan& plan, ImageCache& cache, const DrawTriangles& draw,
                    const Progress& progress) {
  FrameCounts counts;
  std::vector<TexturedTriangle> batch;
  const auto flush = [&] {
    if (batch.empty()) return;
    draw(batch);
    ++counts.batches;
    batch.clear();
  };
  cache.release();
  cache.collect(false);
  for (const ImageNumber image : plan.images) cache.want(image);
  requestAhead(plan.images, cache);
  for (const WeightedTriangle& triangle : plan.triangles) {
    const ImageNumber image = imageOf(triangle.pencil);
    while (!fetch(image, cache, counts, progress)) {
      flush();
      cache.release();
    }
    batch.push_back({triangle, image, *cache.use(image)});
  }
  flush();
  counts.triangles = plan.triangles.size();
  return counts;
}

FrameCounts drawAtHand(const FramePlan& plan, ImageCache& cache, size_t mostUploads,
                       const DrawTriangles& draw) {
  FrameCounts counts;
  cache.release();
  cache.collect(false);
  for (const ImageNumber image : plan.images) cache.want(image);
  for (const ImageNumber image : plan.images)
    if (counts.uploads < mostUploads && cache.placeOf(image) == Place::memory && cache.upload(image))
      ++counts.uploads;
  std::vector<TexturedTriangle> triangles;
  for (const WeightedTriangle& triangle : plan.triangles) {
    Pencil shown = triangle.pencil;
    std::optional<uint32_t> slot = cache.use(imageOf(shown));
    if (!slot) ++counts.substituted;
    while (!slot) {
      assert(shown.level > 0); // those of level 0 are always there
      shown = parentOf(shown);
      slot = cache.use(imageOf(shown));
    }
    triangles.push_back({triangle, imageOf(shown), *slot});
  }
  requestAhead(plan.images, cache);
  draw(triangles);
  counts.batches = 1;
  counts.triangles = plan.triangles.size();
  return counts;
}

FrameCounts countsOf(const FramePlan& plan, const ImageCache& cache) {
  FrameCounts counts;
  counts.triangles = plan.triangles.size();
  for (const ImageNumber image : plan.images) {
    const Place place = cache.placeOf(image);
    if (place != Place::gpu) ++counts.uploads;
    if (place == Place::disk || place == Place::loading) ++counts.reads;
  }
  return counts;
}

} // namespace surflect::spherical
