#include "render/evaluation/contact_sheet.h"

#include "render/evaluation/label.h"
#include "render/evaluation/measure.h"
#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/image/percentile.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace surflect::evaluation {

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
    image::Image photograph = srgbEncoded(applyExposure(overlay.photograph, exposures.photographs));
    blendLine(photograph, overlay.maskOutline, kMaskColor);
    blendLine(photograph, overlay.geometryOutline, kGeometryColor);
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
