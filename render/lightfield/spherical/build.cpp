#include "render/lightfield/spherical/build.h"

#include "render/lightfield/spherical/tile_file.h"
#include "surfel/base/error.h"
#include "surfel/base/stopwatch.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

namespace surflect::spherical {

namespace {

constexpr size_t kBatch = 32; // images made at once, before they are written in their order

void requireOptions(const BuildOptions& options) {
  if (options.levels < 1 || options.levels > kMostLevels)
    throw Error::mismatch("1.." + std::to_string(kMostLevels), std::to_string(options.levels)).at("levels");
  if (options.size < kLeastSize || options.size > kLargestSize ||
      !std::has_single_bit(static_cast<unsigned>(options.size)))
    throw Error::mismatch("a power of two, " + std::to_string(kLeastSize) + ".." +
                              std::to_string(kLargestSize),
                          std::to_string(options.size))
        .at("size");
}

} // namespace

BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const lightfield::RayBlend& rays, const std::filesystem::path& folder,
                  const Progress& progress) {
  requireOptions(options);
  const Stopwatch stopwatch;
  const lightfield::RayRadiance radiance(views, rays, progress);
  const double seconds = stopwatch.seconds();
  const auto makeImage = [&](const Sphere& sphere, const Vec3<double>& direction, int size) {
    return resampled(radiance, sphere, direction, size, progress);
  };
  BuildReport report = build(views.capture(), views.mesh(), makeImage, options, folder, progress);
  report.seconds["photographs"] = seconds;
  return report;
}

BuildReport build(const capture::Capture& cameras, const TriangleMesh& mesh, const MakeImage& makeImage,
                  const BuildOptions& options, const std::filesystem::path& folder,
                  const Progress& progress) {
  requireOptions(options);
  BuildReport report;
  Stopwatch stopwatch;
  report.shape = {options.levels, options.size, sphereAround(mesh, options.size)};
  const DirectionTree tree(options.levels);
  SphericalWriter writer(folder, report.shape);
  const size_t images = report.shape.images();
  for (size_t begin = 0; begin < images; begin += kBatch) {
    const size_t count = std::min(kBatch, images - begin);
    std::vector<std::vector<std::byte>> tiles(count);
    std::vector<std::pair<size_t, size_t>> seen(count); // and unseen
    tbb::parallel_for(size_t{0}, count, [&](size_t i) {
      const Vec3<double> direction = tree.direction(static_cast<ImageNumber>(begin + i));
      ResampledImage image = makeImage(report.shape.sphere, direction, options.size);
      seen[i] = {image.seen, image.unseen};
      tiles[i] = encoded({std::move(image.colors), std::move(image.heights)}, options.size);
    });
    for (size_t i = 0; i < count; ++i) {
      writer.append(tiles[i]);
      report.seen += seen[i].first, report.unseen += seen[i].second;
    }
    progress("images", static_cast<double>(begin + count) / static_cast<double>(images));
  }
  report.seconds["images"] = stopwatch.seconds();
  stopwatch = {};
  writer.commit(cameras, mesh, progress);
  const lightfield::LightFieldFolder written(folder, kFormat, kVersion, progress);
  const SphericalFile file(written);
  for (size_t level = 0; level < options.levels; ++level) report.levelBytes.push_back(file.bytes(level));
  report.bytes = written.bytes();
  report.seconds["write"] = stopwatch.seconds();
  return report;
}

} // namespace surflect::spherical
