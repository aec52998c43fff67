#include "render/lightfield/common/photographs.h"

#include "srf/image/half_float.h"
#include "srf/image/image.h"
#include "srf/weights/fades.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace surflect::lightfield {

namespace {

// Tangent of 72 degrees, where views fade because the surface is seen at a grazing angle.
constexpr double kSteep = 3;

// Distance along a ray to the tangent plane at a hit; not finite if the ray does not meet it.
double distanceToPlane(const PixelHit& hit, const PixelHit& ray) {
  const Vec3<double> point = hit.origin.raw() + hit.distance * hit.direction.raw();
  return hit.normal.dot(point - ray.origin.raw()) / hit.normal.dot(ray.direction.raw());
}

// Distance between the ray of a and that of b where a meets the surface.
double spacing(const PixelHit& a, const PixelHit& b) {
  return (a.origin.raw() + a.distance * a.direction.raw() - b.origin.raw() - a.distance * b.direction.raw())
      .norm();
}

// Does a plane of this slope explain the step from one pixel to the next? Not for slopes that are not finite.
bool predicts(double slope, double step) { return std::abs(step - slope) <= 1 + 0.5 * std::abs(slope); }

} // namespace

bool isContinuous(const PixelHit& a, const PixelHit& b) {
  if (!a.isSurface() || !b.isSurface()) return false;
  const double h = std::min(spacing(a, b), spacing(b, a));
  const double step = (b.distance - a.distance) / h;
  const double slopeA = (distanceToPlane(a, b) - a.distance) / h,
               slopeB = (b.distance - distanceToPlane(b, a)) / h;
  if (!std::isfinite(slopeA) || !std::isfinite(slopeB)) return false;
  if (predicts(slopeA, step) || predicts(slopeB, step)) return true;
  const auto [low, high] = std::minmax(slopeA, slopeB);
  return step >= std::max(low, -kSteep) && step <= std::min(high, kSteep);
}

std::vector<uint8_t> edgeDistances(std::span<const PixelHit> hits, int width) {
  assert(width > 0 && hits.size() % static_cast<size_t>(width) == 0);
  const int height = static_cast<int>(hits.size()) / width;
  const auto indexOf = [width](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  };
  std::vector<uint8_t> isEdge(hits.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (const auto& [dx, dy] : {std::array{1, 0}, {-1, 1}, {0, 1}, {1, 1}}) {
        if (x + dx < 0 || x + dx >= width || y + dy >= height) continue;
        const size_t a = indexOf(x, y), b = indexOf(x + dx, y + dy);
        if (!isContinuous(hits[a], hits[b])) isEdge[a] = isEdge[b] = 1;
      }
  constexpr int kReach = kFarFromEdges - 1;
  std::vector<uint8_t> distances(hits.size(), 0);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (!hits[indexOf(x, y)].isSurface()) continue;
      int least = kReach * kReach; // squared
      for (int j = std::max(0, y - kReach); j <= std::min(height - 1, y + kReach); ++j)
        for (int i = std::max(0, x - kReach); i <= std::min(width - 1, x + kReach); ++i)
          if (isEdge[indexOf(i, j)]) least = std::min(least, (i - x) * (i - x) + (j - y) * (j - y));
      distances[indexOf(x, y)] =
          static_cast<uint8_t>(std::lround(kCodesPerPixel * (1 + std::sqrt(static_cast<double>(least)))));
    }
  return distances;
}

namespace {

constexpr size_t kPicturesPerStep = 8;

bool isOpaque(const image::Image& picture, int x, int y) {
  return picture.at(x, y)[3] >= Photographs::kOpaque;
}

// Whether a pixel has a colour of the object.
bool isObserved(const image::Image& picture, int x, int y) {
  return isOpaque(picture, x, y) && std::all_of(&picture.at(x, y)[0], &picture.at(x, y)[0] + 3,
                                                [](float value) { return std::isfinite(value); });
}

// Where the mesh is seen through the centre of each pixel of a rectangle; nowhere in pixels that are not
// observed.
std::vector<PixelHit> hitsOf(const image::Image& picture, int left, int top, int width, int height,
                             const capture::Camera<AcquisitionSpace>& camera, const TriangleMesh& mesh,
                             const RayCaster<AcquisitionSpace>& rays) {
  const auto acquisitionFromCamera = camera.cameraFromWorld.inverse();
  std::vector<PixelHit> hits(static_cast<size_t>(width) * static_cast<size_t>(height));
  for (size_t i = 0; i < hits.size(); ++i) {
    const int x = left + static_cast<int>(i) % width, y = top + static_cast<int>(i) / width;
    const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
    if (!ray) continue;
    hits[i].origin = acquisitionFromCamera(ray->origin);
    hits[i].direction = acquisitionFromCamera(ray->direction);
    if (!isObserved(picture, x, y)) continue;
    if (const auto hit = rays.firstHit(hits[i].origin, hits[i].direction)) {
      hits[i].distance = hit->distance;
      hits[i].normal = areaVector(mesh, hit->triangle).normalized();
    }
  }
  return hits;
}

} // namespace

Photographs::Picture Photographs::pictureOf(const image::Image& premultiplied,
                                            capture::Camera<AcquisitionSpace> camera,
                                            const TriangleMesh& mesh,
                                            const RayCaster<AcquisitionSpace>& rays) {
  int left = premultiplied.width, top = premultiplied.height, right = 0, bottom = 0;
  for (int y = 0; y < premultiplied.height; ++y)
    for (int x = 0; x < premultiplied.width; ++x)
      if (isOpaque(premultiplied, x, y)) {
        left = std::min(left, std::max(0, x - 1)),
        right = std::max(right, std::min(premultiplied.width, x + 2));
        top = std::min(top, std::max(0, y - 1)),
        bottom = std::max(bottom, std::min(premultiplied.height, y + 2));
      }
  Picture picture{std::move(camera), left, top, std::max(0, right - left), std::max(0, bottom - top), {}, {}};
  if (picture.width == 0) return picture;
  const std::vector<PixelHit> hits =
      hitsOf(premultiplied, left, top, picture.width, picture.height, picture.camera, mesh, rays);
  const std::vector<uint8_t> edges = edgeDistances(hits, picture.width);
  picture.pixels.resize(hits.size());
  for (size_t i = 0; i < hits.size(); ++i) {
    picture.distances.push_back(static_cast<float>(hits[i].distance));
    if (!hits[i].isSurface()) continue;
    const auto pixel = premultiplied.at(left + static_cast<int>(i) % picture.width,
                                        top + static_cast<int>(i) / picture.width);
    for (size_t c = 0; c < 3; ++c) picture.pixels[i][c] = image::finiteHalf(pixel[c] / pixel[3]);
    picture.pixels[i][3] = edges[i];
  }
  return picture;
}

double photographMemory(const Views& views) {
  double pixels = 0;
  for (const size_t view : views.ofSplit(capture::Split::train))
    pixels += static_cast<double>(views.camera(view).lens.width) * views.camera(view).lens.height;
  return 12 * pixels;
}

Photographs::Photographs(const Views& views, const Progress& progress) {
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  pictures_.resize(training.size());
  for (size_t begin = 0; begin < training.size(); begin += kPicturesPerStep) {
    progress("photographs", static_cast<double>(begin) / static_cast<double>(training.size()));
    tbb::parallel_for(begin, std::min(training.size(), begin + kPicturesPerStep), [&](size_t i) {
      const Progress quiet{{}, progress.cancelled};
      pictures_[i] =
          pictureOf(views.read(training[i], quiet), views.camera(training[i]), views.mesh(), views.rays());
    });
  }
  progress("photographs", 1);
}

std::optional<Photographs::Sample> Photographs::at(size_t photograph, capture::Pixel position,
                                                   double distance, double tolerance) const {
  const Picture& picture = pictures_[photograph];
  const double x = position.x - 0.5 - picture.left, y = position.y - 0.5 - picture.top;
  if (!(x >= 0 && y >= 0 && x <= picture.width - 1 && y <= picture.height - 1)) return std::nullopt;
  const int x0 = std::min(static_cast<int>(x), picture.width - 2),
            y0 = std::min(static_cast<int>(y), picture.height - 2);
  if (x0 < 0 || y0 < 0) return std::nullopt; // a picture of one pixel's width
  const auto u = static_cast<float>(x - x0), v = static_cast<float>(y - y0);
  const size_t first = static_cast<size_t>(y0) * static_cast<size_t>(picture.width) + static_cast<size_t>(x0),
               below = first + static_cast<size_t>(picture.width);
  for (const size_t pixel : {first, first + 1, below, below + 1})
    if (!(std::abs(static_cast<double>(picture.distances[pixel]) - distance) <= tolerance))
      return std::nullopt;
  const HalfPixel *upper = &picture.pixels[first], *lower = &picture.pixels[below];
  const auto between = [&](const auto& valueOf) {
    return (1 - v) * ((1 - u) * valueOf(upper[0]) + u * valueOf(upper[1])) +
           v * ((1 - u) * valueOf(lower[0]) + u * valueOf(lower[1]));
  };
  Sample sample;
  for (size_t c = 0; c < 3; ++c)
    sample.radiance[static_cast<Eigen::Index>(c)] =
        between([c](const HalfPixel& pixel) { return image::floatOfHalf(pixel[c]); });
  const float edge = between([](const HalfPixel& pixel) { return static_cast<float>(pixel[3]); });
  sample.fade =
      static_cast<float>(weights::smoothStep(0, kFarFromEdges * kCodesPerPixel, static_cast<double>(edge)));
  return sample;
}

double Photographs::whiteLevel() const {
  constexpr double kShare = 0.995;
  image::PercentileCounter values;
  for (const Picture& picture : pictures_)
    for (size_t i = 0; i < picture.pixels.size(); ++i) {
      const HalfPixel& pixel = picture.pixels[i];
      if (!std::isnan(picture.distances[i]))
        values.add(std::max(
            {image::floatOfHalf(pixel[0]), image::floatOfHalf(pixel[1]), image::floatOfHalf(pixel[2])}));
    }
  const double level = values.percentile(kShare);
  return level > 0 ? level : 1;
}

} // namespace surflect::lightfield
