#include "render/evaluation/overlay.h"

#include "srf/image/color.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

namespace surflect::evaluation {

namespace {

// samples of a pixel in either direction
constexpr int kSamples = 3;
constexpr double kLineWidth = 1.6; // pixels

// Triangles at each vertex: triangles[begin[v] .. begin[v + 1]).
struct Umbrella {
  std::vector<size_t> begin;
  std::vector<uint32_t> triangles;
};

Umbrella trianglesAtVertices(const TriangleMesh& mesh) {
  Umbrella umbrella;
  umbrella.begin.assign(mesh.positions.size() + 2, 0); // shifted by two while filling
  for (const auto& triangle : mesh.triangles)
    for (const uint32_t vertex : triangle) ++umbrella.begin[vertex + 2];
  for (size_t v = 2; v < umbrella.begin.size(); ++v) umbrella.begin[v] += umbrella.begin[v - 1];
  umbrella.triangles.resize(umbrella.begin.back());
  for (uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t]) umbrella.triangles[umbrella.begin[vertex + 1]++] = t;
  umbrella.begin.pop_back();
  return umbrella;
}

// Area-weighted mean of the face normals at a vertex that are not separated from `triangle` by a crease.
Vec3<float> smoothNormal(const Umbrella& umbrella, std::span<const Vec3<double>> areas, size_t triangle,
                         uint32_t vertex) {
  const double cosCrease = std::numbers::sqrt2 / 2; // cosine of 45 degrees
  const Vec3<double>& own = areas[triangle];
  Vec3<double> sum = Vec3<double>::Zero();
  for (size_t i = umbrella.begin[vertex]; i < umbrella.begin[vertex + 1]; ++i) {
    const Vec3<double>& other = areas[umbrella.triangles[i]];
    if (own.dot(other) >= cosCrease * own.norm() * other.norm()) sum += other;
  }
  return sum.normalized().cast<float>(); // not zero: its part along `own` is positive
}

// Radiance of white paint, albedo 1.
Rgb lambert(Rgb irradiance, double cosine) {
  return static_cast<float>(std::max(0.0, cosine) / std::numbers::pi) * irradiance;
}

// Coverage of each pixel by a line along the border of the mask, which has kSamples x kSamples samples per
// pixel. The edge of the image is not a border.
image::Image outlineOf(const image::Mask& fine) {
  constexpr double halfWidth = kLineWidth / 2 * kSamples; // samples
  constexpr int reach = static_cast<int>(halfWidth + 1);
  image::Mask line(fine.width, fine.height);
  const auto isInside = [&](int x, int y) {
    return fine.inside[static_cast<size_t>(y) * static_cast<size_t>(fine.width) + static_cast<size_t>(x)];
  };
  // Draws around the middle (x, y) of a border segment, in samples.
  const auto draw = [&](double x, double y) {
    const int left = static_cast<int>(x), top = static_cast<int>(y);
    for (int j = std::max(0, top - reach); j <= std::min(fine.height - 1, top + reach); ++j)
      for (int i = std::max(0, left - reach); i <= std::min(fine.width - 1, left + reach); ++i)
        if (std::hypot(i + 0.5 - x, j + 0.5 - y) <= halfWidth)
          line.inside[static_cast<size_t>(j) * static_cast<size_t>(fine.width) + static_cast<size_t>(i)] = 1;
  };
  for (int y = 0; y < fine.height; ++y)
    for (int x = 0; x < fine.width; ++x) {
      if (x > 0 && isInside(x, y) != isInside(x - 1, y)) draw(x, y + 0.5);
      if (y > 0 && isInside(x, y) != isInside(x, y - 1)) draw(x + 0.5, y);
    }
  image::Image share(fine.width / kSamples, fine.height / kSamples, 1);
  for (int y = 0; y < fine.height; ++y)
    for (int x = 0; x < fine.width; ++x)
      share.at(x / kSamples, y / kSamples)[0] +=
          line.inside[static_cast<size_t>(y) * static_cast<size_t>(fine.width) + static_cast<size_t>(x)] /
          static_cast<float>(kSamples * kSamples);
  return share;
}

// The mask's window, resampled bilinearly at the samples of a picture.
image::Mask sampled(const image::Image& mask, const image::PixelWindow& window, image::PictureSize size) {
  image::Mask fine(kSamples * size.width, kSamples * size.height);
  for (int y = 0; y < fine.height; ++y)
    for (int x = 0; x < fine.width; ++x) {
      const double maskX = window.x0 + (x + 0.5) * window.width() / fine.width - 0.5;
      const double maskY = window.y0 + (y + 0.5) * window.height() / fine.height - 0.5;
      const int left = static_cast<int>(std::floor(maskX)), top = static_cast<int>(std::floor(maskY));
      double value = 0;
      for (const int i : {left, left + 1})
        for (const int j : {top, top + 1})
          value += (1 - std::abs(maskX - i)) * (1 - std::abs(maskY - j)) *
                   mask.at(std::clamp(i, 0, mask.width - 1), std::clamp(j, 0, mask.height - 1))[0];
      fine.inside[static_cast<size_t>(y) * static_cast<size_t>(fine.width) + static_cast<size_t>(x)] =
          value > 0.5;
    }
  return fine;
}

// Lens that shows a window of the photograph.
capture::Lens windowLens(capture::Lens lens, const image::PixelWindow& window, image::PictureSize size) {
  lens.width = window.width();
  lens.height = window.height();
  lens.centerX -= window.x0;
  lens.centerY -= window.y0;
  return capture::resized(lens, size.width, size.height);
}

struct Rendered {
  image::Image rgba;  // premultiplied
  image::Mask inside; // one value per sample
  double backShare = 0;
};

Rendered rendered(const WhiteSurface& surface, const OverlayView& view, const capture::Light* light,
                  const Progress& progress) {
  const image::PictureSize size = view.size;
  const capture::Lens lens = windowLens(view.camera.lens, view.window, size);
  const auto worldFromCamera = view.camera.cameraFromWorld.inverse();
  Rendered result{image::Image(size.width, size.height, 4),
                  image::Mask(size.width * kSamples, size.height * kSamples)};
  std::atomic<size_t> hits = 0, backs = 0;
  tbb::parallel_for(0, size.height, [&](int y) {
    progress.checkpoint();
    size_t hitsInRow = 0, backsInRow = 0;
    for (int x = 0; x < size.width; ++x)
      for (int sample = 0; sample < kSamples * kSamples; ++sample) {
        const int fineX = kSamples * x + sample % kSamples, fineY = kSamples * y + sample / kSamples;
        const auto ray = capture::rayThrough(lens, {(fineX + 0.5) / kSamples, (fineY + 0.5) / kSamples});
        if (!ray) continue;
        const auto seen = surface.seen(worldFromCamera(ray->origin), worldFromCamera(ray->direction), light);
        if (!seen) continue;
        ++hitsInRow;
        backsInRow += seen->isBack;
        result.inside.inside[static_cast<size_t>(fineY) * static_cast<size_t>(result.inside.width) +
                             static_cast<size_t>(fineX)] = 1;
        const auto pixel = result.rgba.at(x, y);
        const Rgb& radiance = seen->radiance;
        for (const auto& [c, value] : {std::pair{0, radiance.r}, {1, radiance.g}, {2, radiance.b}, {3, 1.f}})
          pixel[static_cast<size_t>(c)] += value / static_cast<float>(kSamples * kSamples);
      }
    hits += hitsInRow, backs += backsInRow;
  });
  if (hits > 0) result.backShare = static_cast<double>(backs) / static_cast<double>(hits);
  return result;
}

Rgb rgbAt(const image::Image& image, size_t pixel) {
  const float* values = &image.values[pixel * static_cast<size_t>(image.channels)];
  return {values[0], values[1], values[2]};
}

} // namespace

WhiteSurface::WhiteSurface(const TriangleMesh& mesh) : rays_(mesh) {
  std::vector<Vec3<double>> areas(mesh.triangles.size());
  for (size_t t = 0; t < areas.size(); ++t) {
    areas[t] = areaVector(mesh, t);
    faceNormals_.push_back(areas[t].normalized().cast<float>());
  }
  const Umbrella umbrella = trianglesAtVertices(mesh);
  for (size_t t = 0; t < areas.size(); ++t)
    for (const uint32_t vertex : mesh.triangles[t])
      cornerNormals_.push_back(smoothNormal(umbrella, areas, t, vertex));
}

auto WhiteSurface::seen(const Point3<AcquisitionSpace, double>& origin,
                        const Direction3<AcquisitionSpace, double>& direction,
                        const capture::Light* light) const -> std::optional<Seen> {
  const auto hit = rays_.firstHit(origin, direction);
  if (!hit) return std::nullopt;
  if (faceNormals_[hit->triangle].cast<double>().dot(direction.raw()) > 0) return Seen{{}, true};
  const auto corner = [&](size_t i) -> Vec3<double> {
    return cornerNormals_[3 * hit->triangle + i].cast<double>();
  };
  const Vec3<double> normal =
      ((1 - hit->b - hit->c) * corner(0) + hit->b * corner(1) + hit->c * corner(2)).normalized();
  if (!light) return Seen{lambert({1, 1, 1}, -normal.dot(direction.raw())), false};

  const auto p = origin + hit->distance * direction;
  const auto towards = capture::towardsLight(*light, p);
  const auto* point = std::get_if<capture::PointLight>(&light->kind);
  const double distance = point ? length(point->position - p) : std::numeric_limits<double>::infinity();
  const double cosine = normal.dot(towards.raw());
  if (cosine <= 0 || rays_.occluded(p, towards, rays_.selfHitOffset(), distance)) return Seen{{}, false};
  return Seen{lambert(capture::irradianceAt(*light, p), cosine), false};
}

double correlation(std::span<const double> a, std::span<const double> b) {
  assert(a.size() == b.size());
  const double count = static_cast<double>(a.size());
  double meanA = 0, meanB = 0, aa = 0, bb = 0, ab = 0;
  for (size_t i = 0; i < a.size(); ++i) meanA += a[i] / count, meanB += b[i] / count;
  for (size_t i = 0; i < a.size(); ++i) {
    const double da = a[i] - meanA, db = b[i] - meanB;
    aa += da * da, bb += db * db, ab += da * db;
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

Overlay overlayOf(const OverlayView& view, const capture::Light* light, const image::Image& radiance,
                  const image::Image* mask, const WhiteSurface& surface, const Progress& progress) {
  Overlay overlay;
  overlay.photograph = image::resampled(radiance, view.window, view.size.width, view.size.height);
  Rendered geometry = rendered(surface, view, light, progress);
  overlay.geometry = std::move(geometry.rgba);
  overlay.geometryOutline = outlineOf(geometry.inside);
  overlay.backShare = geometry.backShare;
  image::Image matte;
  if (mask) {
    matte = image::resampled(*mask, view.window, view.size.width, view.size.height);
    overlay.maskOutline = outlineOf(sampled(*mask, view.window, view.size));
    overlay.maskIou = image::intersectionOverUnion(image::objectMask(*mask), view.silhouette);
  }

  std::vector<double> photographed, shaded;
  for (size_t pixel = 0; 4 * pixel < overlay.geometry.values.size(); ++pixel)
    if (overlay.geometry.values[4 * pixel + 3] > 0.999f && (!mask || matte.values[pixel] > 0.999f)) {
      photographed.push_back(image::luma(rgbAt(overlay.photograph, pixel)));
      shaded.push_back(image::luma(rgbAt(overlay.geometry, pixel)));
    }
  overlay.shadingCorrelation = correlation(photographed, shaded);
  return overlay;
}

} // namespace surflect::evaluation
