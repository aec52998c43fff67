#include "render/lightfield/common/photographs.h"

#include "render/lightfield/common/edge_distance.h"
#include "srf/image/half_float.h"
#include "srf/image/percentile.h"
#include "srf/weights/fades.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace surflect::lightfield {

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
