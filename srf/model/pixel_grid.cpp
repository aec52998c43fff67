#include "srf/model/pixel_grid.h"

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
  weights::PixelGrid grid = pixelGrid(lens, finest);
  while (grid.step<weights::kCoarsestGrid&& static_cast<double>(grid.corners())> kAbout *
         static_cast<double>(most))
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

} // namespace surflect::model
