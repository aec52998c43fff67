#include "render/lightfield/spherical/build.h"

#include "render/lightfield/common/pull_push.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"
#include "surfel/math/bounds.h"

#include <Eigen/Core>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <utility>

namespace surflect::spherical {

Sphere sphereAround(const TriangleMesh& mesh, int size) {
  Sphere sphere{middleOf(mesh.positions).raw(), 0};
  for (const auto& p : mesh.positions)
    sphere.radius = std::max(sphere.radius, (p.raw().cast<double>() - sphere.middle).norm());
  if (!(sphere.radius > 0)) throw Error("has no extent").at("mesh");
  constexpr double kBorder = 1.5; // texels
  sphere.radius *= size / (size - 2 * kBorder);
  return sphere;
}

std::vector<Height> continuedHeights(std::span<const float> heights, const std::vector<bool>& isOnObject,
                                     int size) {
  std::vector<Eigen::Vector4f> texels;
  for (size_t i = 0; i < heights.size(); ++i)
    texels.emplace_back(heights[i], 0.f, 0.f, isOnObject[i] ? 1.f : 0.f);
  lightfield::pullPush(texels, size, size);
  std::vector<Height> result;
  for (const Eigen::Vector4f& texel : texels) result.push_back(heightOf(static_cast<double>(texel[0])));
  return result;
}

ResampledImage resampled(const lightfield::RayRadiance& rays, const Sphere& sphere,
                         const Vec3<double>& direction, int size, const Progress& progress) {
  using Kind = lightfield::RaySample::Kind;
  const ImageAxes axes = axesOf(direction);
  const size_t texels = static_cast<size_t>(size) * static_cast<size_t>(size);
  std::vector<Eigen::Vector4f> colors(texels);
  std::vector<Kind> kinds(texels);
  ResampledImage result;
  std::vector<float> heights(texels); // on the object
  const auto towards = assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(-direction));
  for (size_t texel = 0; texel < texels; ++texel) {
    progress.checkNowAndThen(texel);
    const double column = static_cast<double>(texel % static_cast<size_t>(size));
    const double row = static_cast<double>(texel / static_cast<size_t>(size));
    // From just outside the sphere.
    constexpr double kStart = 0.75;
    const Vec3<double> start(pointOf(sphere, axes, {(column + 0.5) / size, (row + 0.5) / size, kStart}));
    const lightfield::RaySample sample = rays.along(assume<Point3<AcquisitionSpace, double>>(start), towards);
    kinds[texel] = sample.kind;
    colors[texel] << sample.color, sample.kind == Kind::seen ? 1.f : 0.f;
    if (sample.kind != Kind::missed)
      heights[texel] = static_cast<float>(kStart - sample.distance / (2 * sphere.radius));
  }
  result.seen = static_cast<size_t>(std::ranges::count(kinds, Kind::seen));
  result.unseen = static_cast<size_t>(std::ranges::count(kinds, Kind::unseen));
  if (result.unseen > 0) lightfield::pullPush(colors, size, size);
  std::vector<bool> isOnObject;
  for (const Kind kind : kinds) isOnObject.push_back(kind != Kind::missed);
  result.heights = continuedHeights(heights, isOnObject, size);
  result.colors.assign(texels, Texel{});
  for (size_t texel = 0; texel < texels; ++texel) {
    if (kinds[texel] == Kind::missed) continue;
    for (int channel = 0; channel < 3; ++channel)
      result.colors[texel][static_cast<size_t>(channel)] = image::finiteHalf(colors[texel][channel]);
    result.colors[texel][3] = image::nearestHalf(1);
  }
  return result;
}

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

// Throws Error unless all images fit on the disk if they are as large as the first `made`, which take
// `bytes`.
void requireRoom(const FieldShape& shape, double bytes, size_t made, const std::filesystem::path& folder) {
  const size_t images = shape.images();
  atField(fmt::format("levels {} and size {}", shape.levels, shape.size), [&] {
    lightfield::requireDisk(folder, bytes * static_cast<double>(images) / static_cast<double>(made),
                            fmt::format("{} images, by the size of the first {}", images, made));
  });
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
    if (begin == 0) {
      size_t bytes = 0;
      for (const std::vector<std::byte>& tile : tiles) bytes += tile.size();
      requireRoom(report.shape, static_cast<double>(bytes), count, folder);
    }
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
