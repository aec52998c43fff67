#include "srf/model/pixel_grid.h"

#include "srf/codec/block.h"
#include "srf/image/mask.h"
#include "srf/proxy/relief/frontal_plane.h"
#include "surfel/base/error.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/sampling.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <vector>

namespace surflect::model {

weights::PixelGrid pixelGrid(const capture::Lens& lens, int step) {
  assert(step == 1 || step == 2 || step == 4 || step == 8);
  return {step, (lens.width + step - 1) / step + 1, (lens.height + step - 1) / step + 1};
}

weights::PixelGrid pixelGridWithin(const capture::Lens& lens, int finest, size_t most) {
  constexpr double kAbout = 1.05;
  const double limit = kAbout * static_cast<double>(most);
  weights::PixelGrid grid = pixelGrid(lens, finest);
  while (static_cast<double>(grid.corners()) > limit && grid.step < weights::kCoarsestGrid)
    grid = pixelGrid(lens, 2 * grid.step);
  return grid;
}

namespace {

// Gives all known normals their mean, if none is further from that than rounding of the mesh: the weights of
// a distant light are then the same at all corners of a plane, to the bit.
void makeEqualIfFlat(std::vector<Vec3<double>>& normals, const image::Mask& known) {
  constexpr double kFlat = 1e-4;
  Vec3<double> mean = Vec3<double>::Zero();
  for (size_t i = 0; i < normals.size(); ++i)
    if (known.inside[i]) mean += normals[i];
  mean.normalize();
  for (size_t i = 0; i < normals.size(); ++i)
    if (known.inside[i] && (normals[i] - mean).norm() > kFlat) return;
  std::ranges::fill(normals, mean);
}

} // namespace

SurfelCloud cornersOf(const weights::PixelGrid& grid, const capture::Camera<AcquisitionSpace>& camera,
                      const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& caster,
                      const Progress& progress) {
  constexpr double kInside =
      0.25; // pixels: rays through the picture's border may miss a mesh that ends there
  const capture::Lens& lens = camera.lens;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const SmoothNormals normals(mesh, progress);
  std::vector<double> depth(grid.corners());
  std::vector<Vec3<double>> normal(grid.corners());
  image::Mask known(grid.columns, grid.rows), all(grid.columns, grid.rows);
  std::ranges::fill(all.inside, uint8_t{1});
  const auto pixelOf = [&](int column, int row) {
    return capture::Pixel{1.0 * grid.step * column, 1.0 * grid.step * row};
  };
  const auto inside = [&](capture::Pixel pixel) {
    return capture::Pixel{std::clamp(pixel.x, kInside, lens.width - kInside),
                          std::clamp(pixel.y, kInside, lens.height - kInside)};
  };
  tbb::parallel_for(0, grid.rows, [&](int row) {
    progress.checkpoint();
    for (int column = 0; column < grid.columns; ++column) {
      const auto ray = capture::rayThrough(lens, inside(pixelOf(column, row)));
      if (!ray) continue;
      const auto origin = worldFromCamera(ray->origin);
      const auto direction = worldFromCamera(ray->direction);
      const auto hit = caster.firstHit(origin, direction);
      if (!hit) continue;
      const auto place = origin + hit->distance * direction;
      const size_t corner = grid.corner(column, row);
      depth[corner] = -camera.cameraFromWorld(place).z();
      normal[corner] = normals.at(hit->triangle, place.raw());
      known.inside[corner] = 1;
    }
  });
  if (std::ranges::count(known.inside, uint8_t{1}) == 0)
    throw Error("no ray of the camera meets the object's surface");
  makeEqualIfFlat(normal, known);
  const std::vector<size_t> source = image::nearestSeeds(known, all);
  SurfelCloud cloud;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const size_t from = source[grid.corner(column, row)];
      auto point = relief::imagePoint(lens, pixelOf(column, row));
      if (!point) point = relief::imagePoint(lens, inside(pixelOf(column, row)));
      const auto place = relief::atDepth(lens, point.value_or(Vec2<double>(0, 0)), depth[from]);
      cloud.p0.push_back(worldFromCamera(place).cast<float>());
      cloud.r0.push_back(rodriguesOf(assume<Normal3<AcquisitionSpace, double>>(normal[from])));
    }
  estimateSplats(cloud, progress);
  return cloud;
}

void markBesideObject(const weights::PixelGrid& grid, const codec::ViewFile& view, SurfelCloud& cloud,
                      weights::VisibilityWeights& visibility, const Progress& progress) {
  assert(cloud.size() == grid.corners() && visibility.values.size() == cloud.size());
  if (view.blockCount() == 0) return;
  const int perBlock = codec::blockSize / grid.step;
  std::vector<uint8_t> isOnObject(cloud.size());
  constexpr size_t kAtOnce = 1024;
  for (size_t begin = 0; begin < view.blockCount(); begin += kAtOnce) {
    const size_t end = std::min(view.blockCount(), begin + kAtOnce);
    std::vector<uint64_t> present(end - begin);
    constexpr size_t kPart = 64;
    tbb::parallel_for(size_t{0}, (end - begin + kPart - 1) / kPart, [&](size_t part) {
      progress.checkpoint();
      std::vector<uint32_t> blocks;
      for (size_t b = begin + part * kPart; b < std::min(end, begin + (part + 1) * kPart); ++b)
        blocks.push_back(static_cast<uint32_t>(b));
      view.read(blocks,
                [&](size_t i, const codec::Block& block) { present[blocks[i] - begin] = block.present; });
    });
    for (size_t b = begin; b < end; ++b) {
      const codec::BlockPosition place = view.position(static_cast<uint32_t>(b));
      for (int texel = 0; texel < codec::blockTexels; ++texel) {
        if ((present[b - begin] >> texel & 1) == 0) continue;
        const int column = place.x * perBlock + texel % codec::blockSize / grid.step,
                  row = place.y * perBlock + texel / codec::blockSize / grid.step;
        if (column + 1 >= grid.columns || row + 1 >= grid.rows) continue;
        const size_t upper = grid.corner(column, row), lower = grid.corner(column, row + 1);
        isOnObject[upper] = isOnObject[upper + 1] = isOnObject[lower] = isOnObject[lower + 1] = 1;
      }
    }
  }
  for (size_t i = 0; i < cloud.size(); ++i)
    if (!isOnObject[i]) cloud.coverage[i] = 0, visibility.values[i] = 0;
}

} // namespace surflect::model
