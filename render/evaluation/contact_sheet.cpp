#include "render/evaluation/contact_sheet.h"

#include "render/evaluation/label.h"
#include "render/evaluation/measure.h"
#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/image/color.h"
#include "srf/image/image.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <tuple>

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

namespace {

// sRGB values.
constexpr Rgb kPaper{0.1f, 0.1f, 0.12f}, kInk{0.95f, 0.95f, 0.95f}, kGeometryColor{1, 0.3f, 0},
    kMaskColor{0, 0.85f, 1};
constexpr int kGap = 6; // pixels between and around tiles
constexpr int kMargin = 4;

// Bounding box of the silhouette, with a margin that shows whether it is in the right place.
image::PixelWindow windowAround(const image::Mask& silhouette) {
  int x0 = silhouette.width, y0 = silhouette.height, x1 = 0, y1 = 0;
  for (int y = 0; y < silhouette.height; ++y)
    for (int x = 0; x < silhouette.width; ++x)
      if (silhouette.inside[static_cast<size_t>(y) * static_cast<size_t>(silhouette.width) +
                            static_cast<size_t>(x)]) {
        x0 = std::min(x0, x), x1 = std::max(x1, x + 1);
        y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
      }
  if (x0 >= x1) return {0, 0, silhouette.width, silhouette.height};
  const int margin = std::max(x1 - x0, y1 - y0) / 5 + 1;
  return {std::max(0, x0 - margin), std::max(0, y0 - margin), std::min(silhouette.width, x1 + margin),
          std::min(silhouette.height, y1 + margin)};
}

// Largest size in a square cell with the proportions of a window.
image::PictureSize fitted(const image::PixelWindow& window, int cell) {
  const double scale = static_cast<double>(cell) / std::max(window.width(), window.height());
  const auto scaled = [&](int length) { return std::max(1, static_cast<int>(std::lround(scale * length))); };
  return {scaled(window.width()), scaled(window.height())};
}

struct TileSize {
  image::PictureSize picture; // its cell
  int labelScale = 1;

  int width() const { return 2 * picture.width + kMargin; }
  int labelHeight() const { return labelScale * (kLabelHeight + 2); }
  int height() const { return labelHeight() + picture.height; }
};

// Size of a tile; letters are large if a whole label fits.
TileSize tileOf(image::PictureSize picture) {
  constexpr int kLetters = 50;
  picture.width = std::max(picture.width, 80);
  return {picture, picture.width >= kLetters * kLabelAdvance ? 2 : 1};
}

image::PictureSize sheetSize(const TileSize& tile, size_t tiles, int columns) {
  const int rows =
      static_cast<int>((tiles + static_cast<size_t>(columns) - 1) / static_cast<size_t>(columns));
  return {kGap + columns * (tile.width() + kGap),
          kGap + tile.labelHeight() + kGap + rows * (tile.height() + kGap)};
}

image::Image blankPaper(int width, int height) {
  image::Image image(width, height, 3);
  for (size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = std::array{kPaper.r, kPaper.g, kPaper.b}[i % 3];
  return image;
}

void blendLine(image::Image& encoded, const image::Image& share, Rgb color) {
  for (size_t pixel = 0; pixel < share.values.size(); ++pixel)
    for (size_t c = 0; c < 3; ++c) {
      float& value = encoded.values[3 * pixel + c];
      value += share.values[pixel] * (std::array{color.r, color.g, color.b}[c] - value);
    }
}

void place(image::Image& sheet, const image::Image& picture, int x, int y) {
  for (int j = 0; j < picture.height; ++j)
    for (int i = 0; i < picture.width; ++i)
      std::ranges::copy(picture.at(i, j), sheet.at(x + i, y + j).begin());
}

// Exposure that maps the 99.5th percentile to 1; 1 if all values are 0.
double exposureFor(const image::PercentileCounter& values) {
  const double white = values.percentile(0.995);
  return white > 0 ? 1 / white : 1;
}

struct Exposures {
  double photographs, geometry;
};
Exposures exposuresOf(std::span<const Overlay> overlays) {
  image::PercentileCounter photographs, everything, geometry;
  for (const Overlay& overlay : overlays)
    for (size_t pixel = 0; 4 * pixel < overlay.geometry.values.size(); ++pixel) {
      const bool onGeometry = overlay.geometry.values[4 * pixel + 3] > 0.5f;
      for (size_t c = 0; c < 3; ++c) {
        const float value = overlay.photograph.values[3 * pixel + c];
        everything.add(value);
        if (onGeometry) photographs.add(value), geometry.add(overlay.geometry.values[4 * pixel + c]);
      }
    }
  return {exposureFor(photographs.percentile(0.995) > 0 ? photographs : everything), exposureFor(geometry)};
}

image::Image overPaper(const image::Image& rgba, double exposure) {
  image::Image straight(rgba.width, rgba.height, 3);
  for (size_t pixel = 0; 3 * pixel < straight.values.size(); ++pixel)
    for (size_t c = 0; c < 3; ++c)
      if (const float alpha = rgba.values[4 * pixel + 3]; alpha > 0)
        straight.values[3 * pixel + c] = rgba.values[4 * pixel + c] / alpha;
  image::Image encoded = srgbEncoded(applyExposure(straight, exposure));
  for (size_t pixel = 0; 3 * pixel < encoded.values.size(); ++pixel)
    for (size_t c = 0; c < 3; ++c) {
      float& value = encoded.values[3 * pixel + c];
      const float paper = std::array{kPaper.r, kPaper.g, kPaper.b}[c];
      value = paper + rgba.values[4 * pixel + 3] * (value - paper);
    }
  return encoded;
}

std::string labelOf(const Overlay& overlay) {
  std::string label =
      fmt::format("{}  {}", overlay.camera, overlay.light.empty() ? "head light" : overlay.light);
  if (overlay.maskIou) label += fmt::format("  IoU {:.3f}", *overlay.maskIou);
  if (overlay.backShare > 0.01) label += fmt::format("  backs {:.0f}%", 100 * overlay.backShare);
  return label;
}

// Capture without masks, so that masked frames are read whole.
capture::Capture unmasked(const capture::Capture& capture) {
  capture::Capture plain = capture;
  for (capture::Frame& frame : plain.frames) frame.mask.clear();
  return plain;
}

// Photograph composited over black.
image::Image asTheCameraSawIt(const capture::Photograph& photograph) {
  image::Image radiance = photograph.radiance;
  for (size_t pixel = 0; pixel < photograph.alpha.values.size(); ++pixel)
    for (size_t c = 0; c < 3; ++c) radiance.values[3 * pixel + c] *= photograph.alpha.values[pixel];
  return radiance;
}

// Views of the chosen frames by index, except for the size of their pictures.
std::map<size_t, OverlayView> viewsOf(const capture::Capture& capture, std::span<const size_t> frames,
                                      const WhiteSurface& surface, const Progress& progress) {
  std::map<size_t, OverlayView> views;
  for (const size_t frame : frames) {
    const size_t index = capture.frames[frame].view;
    if (views.contains(index)) continue;
    progress.checkpoint();
    OverlayView& view = views[index];
    view.camera = capture.views[index].camera;
    view.silhouette = image::objectMask(capture::silhouette(view.camera, surface.rays()));
    view.window = windowAround(view.silhouette);
  }
  return views;
}

// Arrangement of the tiles on a sheet.
struct SheetLayout {
  int cell = 0; // side of the square that a picture must fit
  TileSize tile;
  int columns = 1;
};

// Largest cells, magnified at most four times, with which the sheet stays below 4000 pixels; the height may
// exceed this to keep labels legible.
SheetLayout layoutOf(const std::map<size_t, OverlayView>& views, size_t tiles) {
  constexpr int kLargest = 400, kSmallest = 120, kStep = 8, kSide = 4000, kMagnification = 4;
  int longest = 0;
  for (const auto& [index, view] : views)
    longest = std::max({longest, view.window.width(), view.window.height()});
  for (int cell = std::min(kLargest, kMagnification * longest);; cell -= kStep) {
    image::PictureSize largest;
    for (const auto& [index, view] : views) {
      const image::PictureSize size = fitted(view.window, cell);
      largest = {std::max(largest.width, size.width), std::max(largest.height, size.height)};
    }
    const TileSize tile = tileOf(largest);
    const int most = (kSide - 1 - kGap) / (tile.width() + kGap);
    const double square = std::sqrt(static_cast<double>(tiles) * tile.height() / tile.width());
    const int columns = std::clamp(static_cast<int>(std::ceil(square)), 1, most);
    if (cell <= kSmallest || sheetSize(tile, tiles, columns).height < kSide) return {cell, tile, columns};
  }
}

std::vector<Overlay> overlaysOf(const capture::Capture& capture, std::span<const size_t> frames,
                                const std::map<size_t, OverlayView>& views, const WhiteSurface& surface,
                                const Progress& progress) {
  constexpr size_t kAtOnce = 8; // photographs in memory at a time
  const capture::Capture plain = unmasked(capture);
  std::vector<Overlay> overlays;
  for (size_t begin = 0, end; begin < frames.size(); begin = end) {
    const size_t view = capture.frames[frames[begin]].view;
    for (end = begin; end < frames.size() && end < begin + kAtOnce; ++end)
      if (capture.frames[frames[end]].view != view) break;
    const auto run = frames.subspan(begin, end - begin);
    const auto photographs = capture::readPhotographs(plain, run, progress);
    const bool hasMasks = std::ranges::any_of(run, [&](size_t i) { return !capture.frames[i].mask.empty(); });
    const auto masked = hasMasks ? capture::readPhotographs(capture, run, progress) : photographs;
    for (size_t i = 0; i < run.size(); ++i) {
      progress("overlay", static_cast<double>(overlays.size()) / static_cast<double>(frames.size()));
      const auto lightIndex = capture.frames[run[i]].light;
      const capture::Light* light = lightIndex ? &capture.lights[*lightIndex] : nullptr;
      Overlay& overlay = overlays.emplace_back(
          overlayOf(views.at(view), light, asTheCameraSawIt(photographs[i]),
                    masked[i].hasMatte ? &masked[i].alpha : nullptr, surface, progress));
      overlay.camera = capture.views[view].identity;
      if (light) overlay.light = light->identity;
    }
  }
  progress("overlay", 1);
  return overlays;
}

// The photograph of an overlay with its outlines, in sRGB values.
image::Image outlined(const Overlay& overlay, double exposure) {
  image::Image photograph = srgbEncoded(applyExposure(overlay.photograph, exposure));
  blendLine(photograph, overlay.maskOutline, kMaskColor);
  blendLine(photograph, overlay.geometryOutline, kGeometryColor);
  return photograph;
}

image::Image drawn(std::span<const Overlay> overlays, const SheetLayout& layout) {
  const TileSize& tile = layout.tile;
  const image::PictureSize size = sheetSize(tile, overlays.size(), layout.columns);
  image::Image sheet = blankPaper(size.width, size.height);
  int x = drawLabel(sheet, kGap, kGap, "geometry", kGeometryColor, tile.labelScale);
  const bool hasMasks = std::ranges::any_of(overlays, [](const Overlay& o) { return o.maskIou.has_value(); });
  if (hasMasks) x = drawLabel(sheet, x, kGap, "  mask", kMaskColor, tile.labelScale);
  drawLabel(sheet, x, kGap, "  white under the stated light", kInk, tile.labelScale);

  const Exposures exposures = exposuresOf(overlays);
  for (size_t i = 0; i < overlays.size(); ++i) {
    const Overlay& overlay = overlays[i];
    const image::Image photograph = outlined(overlay, exposures.photographs);
    const auto columns = static_cast<size_t>(layout.columns);
    const int left = kGap + static_cast<int>(i % columns) * (tile.width() + kGap);
    const int top = kGap + tile.labelHeight() + kGap + static_cast<int>(i / columns) * (tile.height() + kGap);
    image::Image label = blankPaper(tile.width(), tile.labelHeight());
    drawLabel(label, 0, 0, labelOf(overlay), kInk, tile.labelScale);
    place(sheet, label, left, top);
    const int centered = left + (tile.picture.width - photograph.width) / 2;
    place(sheet, photograph, centered, top + tile.labelHeight());
    place(sheet, overPaper(overlay.geometry, exposures.geometry), centered + tile.picture.width + kMargin,
          top + tile.labelHeight());
  }
  return sheet;
}

} // namespace

std::vector<size_t> spreadFrames(const capture::Capture& capture, size_t count) {
  const size_t total = capture.frames.size();
  std::vector<size_t> chosen;
  // Targets are spread over views in order, and over lights by the golden ratio; each takes the nearest
  // unused frame.
  const auto fraction = [](size_t index, size_t size) {
    return (static_cast<double>(index) + 0.5) / static_cast<double>(size);
  };
  const double golden = (std::sqrt(5.0) - 1) / 2;
  std::vector<uint8_t> taken(total, 0);
  for (size_t k = 0; k < std::min(count, total); ++k) {
    const double view = fraction(k, std::min(count, total)),
                 light = std::fmod(golden * static_cast<double>(k), 1.0);
    size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < total; ++i) {
      const capture::Frame& frame = capture.frames[i];
      if (taken[i]) continue;
      const double dv = fraction(frame.view, capture.views.size()) - view;
      const double dl = frame.light ? fraction(*frame.light, capture.lights.size()) - light : 0;
      if (const double d = dv * dv + dl * dl; d < least) least = d, nearest = i;
    }
    taken[nearest] = 1;
    chosen.push_back(nearest);
  }
  std::ranges::sort(chosen, {}, [&](size_t i) {
    return std::tuple(capture.frames[i].view, capture.frames[i].light.value_or(0), i);
  });
  return chosen;
}

image::Image outlinedPhotograph(const capture::Capture& capture, size_t frame, const WhiteSurface& surface,
                                image::PictureSize size, double exposure, const Progress& progress) {
  auto views = viewsOf(capture, std::span(&frame, 1), surface, progress);
  OverlayView& view = views.begin()->second;
  view.window = {0, 0, view.silhouette.width, view.silhouette.height};
  view.size = size;
  return outlined(overlaysOf(capture, std::span(&frame, 1), views, surface, progress).front(), exposure);
}

ContactSheet contactSheet(const capture::Capture& capture, std::span<const size_t> frames,
                          const WhiteSurface& surface, const Progress& progress) {
  assert(!frames.empty());
  auto views = viewsOf(capture, frames, surface, progress);
  const SheetLayout layout = layoutOf(views, frames.size());
  for (auto& [index, view] : views) view.size = fitted(view.window, layout.cell);
  ContactSheet sheet;
  sheet.overlays = overlaysOf(capture, frames, views, surface, progress);
  sheet.image = drawn(sheet.overlays, layout);
  return sheet;
}

} // namespace surflect::evaluation
