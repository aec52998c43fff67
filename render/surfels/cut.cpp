#include "render/surfels/cut.h"

#include "render/splat/splat.h"
#include "warp/deform.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surflect::surfels {

namespace {

constexpr size_t kPatchSize = 64; // surfels of one level

} // namespace

CutLevels cutLevels(const SurfelCloud& cloud, const Progress& progress) {
  CutLevels result{levelsOfDetail(cloud, 10, progress), patchesOf(cloud, kPatchSize), {}};
  result.middles = subsetOf(cloud, result.patches.middle);
  return result;
}

double levelFor(double size, double wanted) {
  return size > 0 ? std::max(0.0, 2 * std::log2(wanted / size)) : 0;
}

double pixelsPerLength(const capture::Camera<ObjectSpace>& camera, const DeformedCloud& deformed,
                       size_t surfel) {
  if (deformed.handedness[surfel] == Handedness::dead) return 0;
  const auto p = camera.cameraFromWorld(deformed.p[surfel].cast<double>());
  if (camera.lens.model == capture::Lens::Model::pinhole && !(p.z() < 0)) return 0;
  const auto inCamera = [&](const Direction3<ObjectSpace>& d) {
    return assume<Direction3<CameraSpace, double>>(
        Vec3<double>(camera.cameraFromWorld.rotation() * d.raw().cast<double>()));
  };
  // Radius 0 would be a point; this is small enough for the image to be affine.
  const double s = 1e-6 * p.raw().norm() /
                   std::max({deformed.u[surfel].raw().norm(), deformed.v[surfel].raw().norm(), 1e-30f});
  const Mat3<double> covariance =
      splat::project(camera.lens, p, inCamera(deformed.u[surfel]), inCamera(deformed.v[surfel]), s)
          .covariance;
  const double xx = covariance(0, 0) / (s * s), xy = covariance(0, 1) / (s * s),
               yy = covariance(1, 1) / (s * s);
  const double largest = std::sqrt((xx + yy) / 2 + std::hypot((xx - yy) / 2, xy)); // stretch
  const double product = std::sqrt(std::max(0.0, xx * yy - xy * xy));
  const double pixels = std::sqrt(std::max(product, kLeastTilt * largest * largest));
  return std::isfinite(pixels) ? pixels : 0;
}

Cut cutFor(const SurfelCloud& cloud, const CutLevels& levels, const warp::Warp& warp,
           const capture::Camera<ObjectSpace>& camera, double surfelSize, const Progress& progress,
           Cut kept) {
  Cut cut = std::move(kept);
  cut.middles = warp::deform(levels.middles, warp, progress, std::move(cut.middles));
  const Patches& patches = levels.patches;
  const double coarsest = static_cast<double>(levels.detail.count) - 1;
  // Surfels of a patch at its level; use(surfel) for each.
  const auto forSurfels = [&](size_t patch, size_t level, const auto& use) {
    for (uint32_t surfel = patches.first[patch]; surfel < patches.first[patch + 1]; ++surfel)
      if (levels.detail.of(surfel).size() > level) use(surfel);
  };
  cut.levels.resize(patches.size());
  cut.first.assign(patches.size() + 1, 0);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, patches.size(), 256), [&](const auto& range) {
    progress.checkpoint();
    for (size_t patch = range.begin(); patch < range.end(); ++patch) {
      const double size = levels.middles.radius[patch] * pixelsPerLength(camera, cut.middles, patch);
      cut.levels[patch] = std::min(levelFor(size, surfelSize), coarsest);
      forSurfels(patch, static_cast<size_t>(cut.levels[patch]), [&](uint32_t) { ++cut.first[patch + 1]; });
    }
  });
  std::partial_sum(cut.first.begin(), cut.first.end(), cut.first.begin());
  const size_t count = cut.first.back();
  cut.surfels.resize(count);
  cut.cloud.p0.resize(count);
  cut.cloud.r0.resize(count);
  cut.cloud.radius.resize(count);
  cut.cloud.coverage.resize(count);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, patches.size(), 256), [&](const auto& range) {
    progress.checkpoint();
    for (size_t patch = range.begin(); patch < range.end(); ++patch) {
      const auto level = static_cast<size_t>(cut.levels[patch]);
      const auto part = static_cast<float>(cut.levels[patch] - static_cast<double>(level));
      size_t i = cut.first[patch];
      forSurfels(patch, level, [&](uint32_t surfel) {
        const auto [radius, coverage] = *splatAt(levels.detail.of(surfel), level, part);
        cut.surfels[i] = surfel;
        cut.cloud.p0[i] = cloud.p0[surfel];
        cut.cloud.r0[i] = cloud.r0[surfel];
        cut.cloud.radius[i] = radius;
        cut.cloud.coverage[i++] = coverage;
      });
    }
  });
  return cut;
}

} // namespace surflect::surfels
