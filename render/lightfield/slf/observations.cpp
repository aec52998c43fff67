#include "render/lightfield/slf/observations.h"

#include "srf/ulr/visibility_weights.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace surflect::slf {

namespace {

using Point = Point3<AcquisitionSpace, double>;

// Least fade: a photograph that sees a point badly still counts where it is the only one.
constexpr double kLeastFade = 1e-3;

// Largest difference in distance between a point and a surface through it, over the four pixels around the
// point, which are at most sqrt(2) pixels away, with as much again for curvature.
double depthTolerance(double footprint, double cosTheta) {
  const double tangent = std::sqrt(std::max(0.0, 1 - cosTheta * cosTheta)) / cosTheta;
  return 2 * std::sqrt(2.0) * footprint * (tangent + 0.5);
}

// The photographs and the geometry in their way.
class Sight {
public:
  Sight(const TriangleMesh& mesh, const SmoothNormals& normals, const Photographs& photographs,
        const RayCaster<AcquisitionSpace>& rays)
      : mesh_(mesh), normals_(normals), photographs_(photographs), rays_(rays) {
    for (size_t p = 0; p < photographs.size(); ++p) {
      viewpoints_.emplace_back(photographs.camera(p));
      projectors_.emplace_back(photographs.camera(p));
    }
  }
  size_t photographs() const { return viewpoints_.size(); }

  std::vector<Observation> observationsOf(const TexelPoint& point) const {
    std::vector<Observation> seen;
    if (point.meshTriangle == TexelPoint::kNone) return seen;
    const Vec3<double> face = areaVector(mesh_, point.meshTriangle).normalized();
    const Vec3<double> normal = normals_.at(point.meshTriangle, point.position.raw());
    const double offset = rays_.selfHitOffset();
    const Point lifted = point.position + assume<Direction>(offset * face);
    for (size_t p = 0; p < photographs(); ++p) {
      const Direction towards = viewpoints_[p].towards(point.position);
      if (!(towards.raw().dot(face) > kGrazing)) continue;
      const std::optional<capture::Pixel> pixel = projectors_[p](point.position);
      if (!pixel) continue;
      const double footprint = footprintAt(p, point.position);
      const std::optional<Vec3<float>> radiance =
          photographs_.at(p, *pixel, distanceTo(p, point.position),
                          depthTolerance(footprint, towards.raw().dot(face)) + offset);
      if (!radiance) continue;
      const double fade = std::max(kLeastFade, ulr::grazingFade(towards.raw().dot(normal)) *
                                                   ulr::borderFade(photographs_.camera(p).lens, *pixel));
      if (rays_.occluded(lifted, towards, offset, viewpoints_[p].distance(point.position))) continue;
      seen.push_back({static_cast<uint32_t>(p), towards.cast<float>(), *radiance, static_cast<float>(fade)});
    }
    return seen;
  }

  // Distance of two points in a photograph, in pixels; infinite if it does not show the second.
  double pixelDistance(uint32_t photograph, const TexelPoint& a, const TexelPoint& b) const {
    const std::optional<capture::Pixel> from = projectors_[photograph](a.position),
                                        to = projectors_[photograph](b.position);
    if (!from || !to) return std::numeric_limits<double>::infinity();
    return std::hypot(from->x - to->x, from->y - to->y);
  }

private:
  // Distance along the ray of a pixel, which begins at the camera or in the plane of an orthographic one.
  double distanceTo(size_t photograph, const Point& point) const {
    return viewpoints_[photograph].isDistant() ? -photographs_.camera(photograph).cameraFromWorld(point).z()
                                               : viewpoints_[photograph].distance(point);
  }
  // Width of a pixel at a point.
  double footprintAt(size_t photograph, const Point& point) const {
    const capture::Lens& lens = photographs_.camera(photograph).lens;
    const double focal = std::min(lens.focalX, lens.focalY);
    return (viewpoints_[photograph].isDistant() ? 1 : viewpoints_[photograph].distance(point)) / focal;
  }

  const TriangleMesh& mesh_;
  const SmoothNormals& normals_;
  const Photographs& photographs_;
  const RayCaster<AcquisitionSpace>& rays_;
  std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints_;
  std::vector<capture::Projector<AcquisitionSpace>> projectors_;
};

// Photographs that see a texel, as bits.
using Viewers = std::vector<uint64_t>;

bool isIn(const Viewers& viewers, uint32_t photograph) {
  return viewers[photograph / 64] >> photograph % 64 & 1;
}

// Texels of a chart with the photographs that see each.
struct Seen {
  std::span<const TexelPoint> points;
  int width;
  std::vector<std::vector<Observation>> observations; // of each texel, in the order of photographs
  std::vector<Viewers> viewers;

  // Calls work with the texels at most 2 rows and columns away.
  template <class Work> void around(size_t texel, const Work& work) const {
    constexpr int kReach = 2;
    const int x = static_cast<int>(texel) % width, y = static_cast<int>(texel) / width,
              rows = static_cast<int>(points.size()) / width;
    for (int j = std::max(0, y - kReach); j <= std::min(rows - 1, y + kReach); ++j)
      for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i)
        work(static_cast<size_t>(j * width + i));
  }
};

// Photographs that see a texel and all around it.
Viewers viewersOfAllAround(const Seen& seen, size_t texel) {
  Viewers common = seen.viewers[texel];
  seen.around(texel, [&](size_t other) {
    for (size_t word = 0; word < common.size(); ++word) common[word] &= seen.viewers[other][word];
  });
  return common;
}

// Distance in a photograph, in pixels, from a texel to the nearest one around it that is hidden; infinite if
// none is.
double distanceToHidden(const Seen& seen, const Sight& sight, size_t texel, uint32_t photograph) {
  double least = std::numeric_limits<double>::infinity();
  seen.around(texel, [&](size_t other) {
    if (!isIn(seen.viewers[other], photograph))
      least = std::min(least, sight.pixelDistance(photograph, seen.points[texel], seen.points[other]));
  });
  return least;
}

// Observations of a texel, which fade near hidden texels.
std::vector<Observation> awayFromEdges(const Seen& seen, const Sight& sight, size_t texel) {
  constexpr double kClear = 3; // pixels
  const Viewers clear = viewersOfAllAround(seen, texel);
  std::vector<Observation> kept;
  for (const Observation& observation : seen.observations[texel]) {
    const double fade =
        isIn(clear, observation.photograph)
            ? 1
            : ulr::smoothStep(0, kClear, distanceToHidden(seen, sight, texel, observation.photograph));
    kept.emplace_back(observation).fade =
        std::max(static_cast<float>(kLeastFade), observation.fade * static_cast<float>(fade));
  }
  return kept;
}

} // namespace

Observations::Observations(std::span<const TexelPoint> points, int width, const TriangleMesh& mesh,
                           const SmoothNormals& normals, const Photographs& photographs,
                           const RayCaster<AcquisitionSpace>& rays) {
  const Sight sight(mesh, normals, photographs, rays);
  Seen seen{points, width, std::vector<std::vector<Observation>>(points.size()),
            std::vector(points.size(), Viewers((photographs.size() + 63) / 64))};
  std::vector<std::vector<Observation>> kept(points.size());
  tbb::parallel_for(size_t{0}, points.size(), [&](size_t texel) {
    seen.observations[texel] = sight.observationsOf(points[texel]);
    for (const Observation& observation : seen.observations[texel])
      seen.viewers[texel][observation.photograph / 64] |= uint64_t{1} << observation.photograph % 64;
  });
  tbb::parallel_for(size_t{0}, points.size(),
                    [&](size_t texel) { kept[texel] = awayFromEdges(seen, sight, texel); });
  first_.push_back(0);
  for (const std::vector<Observation>& observations : kept) {
    all_.insert(all_.end(), observations.begin(), observations.end());
    first_.push_back(all_.size());
  }
}

} // namespace surflect::slf
