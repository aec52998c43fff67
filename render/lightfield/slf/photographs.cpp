#include "render/lightfield/slf/photographs.h"

#include "srf/image/half_float.h"
#include "srf/image/percentile.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace surflect::slf {

namespace {

constexpr size_t kPicturesPerStep = 8;

bool isOpaque(const image::Image& picture, int x, int y) {
  return picture.at(x, y)[3] >= Photographs::kOpaque;
}

// Distance from the camera to the mesh through a pixel's centre; NaN if there is none.
float distanceThrough(const capture::Camera<AcquisitionSpace>& camera,
                      const Rigid<AcquisitionSpace, CameraSpace>& acquisitionFromCamera,
                      const RayCaster<AcquisitionSpace>& rays, int x, int y) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
  if (!ray) return kNone;
  const auto hit = rays.firstHit(acquisitionFromCamera(ray->origin), acquisitionFromCamera(ray->direction));
  return hit ? static_cast<float>(hit->distance) : kNone;
}

// The half float nearest to a value; the largest one for a larger value.
uint16_t finiteHalf(float value) {
  constexpr float kLargest = 65504;
  return image::nearestHalf(std::isnan(value) ? 0.f : std::clamp(value, -kLargest, kLargest));
}

} // namespace

Photographs::Picture Photographs::pictureOf(const image::Image& premultiplied,
                                            capture::Camera<AcquisitionSpace> camera,
                                            const RayCaster<AcquisitionSpace>& rays) {
  int left = premultiplied.width, top = premultiplied.height, right = 0, bottom = 0;
  for (int y = 0; y < premultiplied.height; ++y)
    for (int x = 0; x < premultiplied.width; ++x)
      if (isOpaque(premultiplied, x, y)) {
        left = std::min(left, x), right = std::max(right, x + 1);
        top = std::min(top, y), bottom = std::max(bottom, y + 1);
      }
  Picture picture{std::move(camera), left, top, std::max(0, right - left), std::max(0, bottom - top), {}, {}};
  const auto acquisitionFromCamera = picture.camera.cameraFromWorld.inverse();
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      HalfPixel& half = picture.pixels.emplace_back();
      float& distance = picture.distances.emplace_back(std::numeric_limits<float>::quiet_NaN());
      if (!isOpaque(premultiplied, x, y)) continue;
      distance = distanceThrough(picture.camera, acquisitionFromCamera, rays, x, y);
      const auto pixel = premultiplied.at(x, y);
      for (size_t c = 0; c < 3; ++c) half[c] = finiteHalf(pixel[c] / pixel[3]);
      half[3] = 1;
    }
  return picture;
}

Photographs::Photographs(const lightfield::Views& views, const Progress& progress) {
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  pictures_.resize(training.size());
  for (size_t begin = 0; begin < training.size(); begin += kPicturesPerStep) {
    progress("photographs", static_cast<double>(begin) / static_cast<double>(training.size()));
    tbb::parallel_for(begin, std::min(training.size(), begin + kPicturesPerStep), [&](size_t i) {
      const Progress quiet{{}, progress.cancelled};
      pictures_[i] = pictureOf(views.read(training[i], quiet), views.camera(training[i]), views.rays());
    });
  }
  progress("photographs", 1);
}

std::optional<Vec3<float>> Photographs::at(size_t photograph, capture::Pixel position, double distance,
                                           double tolerance) const {
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
    if (!picture.pixels[pixel][3] ||
        !(std::abs(static_cast<double>(picture.distances[pixel]) - distance) <= tolerance))
      return std::nullopt;
  const HalfPixel *upper = &picture.pixels[first], *lower = &picture.pixels[below];
  Vec3<float> radiance;
  for (size_t c = 0; c < 3; ++c) {
    const auto value = [c](const HalfPixel& pixel) { return image::floatOfHalf(pixel[c]); };
    radiance[static_cast<Eigen::Index>(c)] = (1 - v) * ((1 - u) * value(upper[0]) + u * value(upper[1])) +
                                             v * ((1 - u) * value(lower[0]) + u * value(lower[1]));
  }
  return radiance;
}

double Photographs::whiteLevel() const {
  constexpr double kShare = 0.995;
  image::PercentileCounter values;
  for (const Picture& picture : pictures_)
    for (const HalfPixel& pixel : picture.pixels)
      if (pixel[3])
        values.add(std::max(
            {image::floatOfHalf(pixel[0]), image::floatOfHalf(pixel[1]), image::floatOfHalf(pixel[2])}));
  const double level = values.percentile(kShare);
  return level > 0 ? level : 1;
}

} // namespace surflect::slf
