#include "render/chart/samples.h"

#include "render/evaluation/contact_sheet.h"
#include "render/evaluation/flip.h"
#include "srf/image/png.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::chart {

namespace {

std::string nameOf(const capture::Capture& capture, const capture::Frame& frame) {
  std::string name = "camera " + capture.views[frame.view].identity;
  if (frame.light) name += ", light " + capture.lights[*frame.light].identity;
  return name;
}

template <class Values> uint64_t hashOf(const Values& values) {
  return contentHash(std::as_bytes(std::span(values)));
}

// Hash of what a frame shows besides the object and its warp: camera and lights.
uint64_t hashOf(const scene::Scene& scene) {
  const capture::Lens& lens = scene.camera.lens;
  std::vector<double> numbers{static_cast<double>(lens.model),
                              static_cast<double>(lens.width),
                              static_cast<double>(lens.height),
                              lens.focalX,
                              lens.focalY,
                              lens.centerX,
                              lens.centerY,
                              lens.k1,
                              lens.k2,
                              lens.p1,
                              lens.p2,
                              lens.k3};
  const auto addVector = [&](const auto& vector) {
    numbers.insert(numbers.end(), vector.data(), vector.data() + vector.size());
  };
  const auto addColor = [&](Rgb color) { numbers.insert(numbers.end(), {color.r, color.g, color.b}); };
  addVector(scene.camera.cameraFromWorld.rotation());
  addVector(scene.camera.cameraFromWorld.translation());
  for (const scene::ShotLight& light : scene.lights) {
    numbers.push_back(static_cast<double>(light.index()));
    if (const auto* directional = std::get_if<scene::ShotDirectionalLight>(&light)) {
      addVector(directional->towards.raw());
      addColor(directional->irradiance);
      addVector(directional->irradianceGradient);
    } else if (const auto* point = std::get_if<scene::ShotPointLight>(&light)) {
      addVector(point->position.raw());
      addColor(point->intensity);
    }
  }
  return hashOf<std::vector<double>>(numbers);
}

// Bounding box of the mask with a small margin; the whole picture if the mask is empty.
image::PixelWindow windowAround(const image::Mask& mask) {
  image::PixelWindow window{mask.width, mask.height, 0, 0};
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      if (mask.inside[static_cast<size_t>(y) * static_cast<size_t>(mask.width) + static_cast<size_t>(x)]) {
        window.x0 = std::min(window.x0, x), window.x1 = std::max(window.x1, x + 1);
        window.y0 = std::min(window.y0, y), window.y1 = std::max(window.y1, y + 1);
      }
  if (window.x0 >= window.x1) return {0, 0, mask.width, mask.height};
  const int margin = std::max(window.width(), window.height()) / 20 + 1;
  return {std::max(0, window.x0 - margin), std::max(0, window.y0 - margin),
          std::min(mask.width, window.x1 + margin), std::min(mask.height, window.y1 + margin)};
}

// PNG of three sRGB channels in 0..1.
std::string pngOf(const image::Image& srgb) {
  image::PngSamples samples{srgb.width, srgb.height, 3, 8, image::PngColors::srgb, {}};
  const auto channels = static_cast<size_t>(srgb.channels);
  for (size_t i = 0; i < srgb.values.size(); i += channels)
    for (size_t c = 0; c < 3; ++c)
      samples.bytes.push_back(static_cast<uint8_t>(image::quantized(srgb.values[i + c], 255)));
  return image::pngBytes(samples);
}

} // namespace

Samples::Samples(const capture::Capture& capture, const capture::Capture& rig, warp::WarpPointer warp,
                 size_t count, const Progress& progress)
    : warp_(std::move(warp)) {
  evaluation::TrueFrames truths(capture, rig, *warp_, capture::Split::test, progress);
  const capture::Capture& frames = truths.capture();
  exposure_ = truths.exposure();
  heldOut_ = frames.frames.size();
  std::vector<std::vector<size_t>> byView(frames.views.size());
  for (const size_t frame : evaluation::spreadFrames(frames, count))
    byView[frames.frames[frame].view].push_back(frame);
  std::vector<uint64_t> hashes{hashOf(std::array{exposure_})};
  for (const std::vector<size_t>& view : byView) {
    if (view.empty()) continue;
    std::vector<image::Image> pictures = truths.read(view, progress);
    for (size_t i = 0; i < view.size(); ++i) {
      hashes.push_back(hashOf(pictures[i].values));
      samples_.push_back(
          {truths.sceneOf(view[i]), std::move(pictures[i]), nameOf(frames, frames.frames[view[i]])});
      hashes.push_back(hashOf(samples_.back().scene));
    }
  }
  hash_ = hashOf(hashes);
  if (std::ranges::all_of(samples_, [](const Sample& sample) {
        return std::ranges::count(image::objectMask(sample.truth).inside, 1) == 0;
      }))
    throw Error("no pixel of an object in the photographs: nothing to measure").at("frames").in(capture.file);
}

size_t Samples::brightest() const {
  const auto light = [&](const Sample& sample) {
    double sum = 0;
    const image::Image exposed = evaluation::applyExposure(sample.truth, exposure_);
    for (size_t i = 0; i < exposed.values.size(); i += 4)
      sum += exposed.values[i] + exposed.values[i + 1] + exposed.values[i + 2];
    return sum;
  };
  return static_cast<size_t>(std::ranges::max_element(samples_, {}, light) - samples_.begin());
}

scene::Scene scaled(scene::Scene scene, double scale) {
  capture::Lens& lens = scene.camera.lens;
  const auto side = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(pixels * scale))); };
  if (scale != 1) lens = capture::resized(lens, side(lens.width), side(lens.height));
  return scene;
}

image::Image enlarged(image::Image small, int width, int height) {
  if (small.width == width && small.height == height) return small;
  image::Image result(width, height, small.channels);
  struct Place {
    int first, second;
    float weight; // of the second
  };
  const auto placeOf = [](int pixel, int size, int of) {
    const double at = std::clamp((pixel + 0.5) * of / size - 0.5, 0.0, of - 1.0);
    const int first = static_cast<int>(at);
    return Place{first, std::min(first + 1, of - 1), static_cast<float>(at - first)};
  };
  for (int y = 0; y < height; ++y) {
    const Place row = placeOf(y, height, small.height);
    for (int x = 0; x < width; ++x) {
      const Place column = placeOf(x, width, small.width);
      const auto between = [&](int line, size_t c) {
        return std::lerp(small.at(column.first, line)[c], small.at(column.second, line)[c], column.weight);
      };
      for (size_t c = 0; c < static_cast<size_t>(small.channels); ++c)
        result.at(x, y)[c] = std::lerp(between(row.first, c), between(row.second, c), row.weight);
    }
  }
  return result;
}

void PooledAgreement::add(const image::Image& truth, const image::Image& rendered, double exposure) {
  difference_ += evaluation::compare(truth, rendered, exposure);
  image::Image a = evaluation::applyExposure(truth, exposure),
               b = evaluation::applyExposure(rendered, exposure);
  evaluation::blackenInvalid(a, truth);
  evaluation::blackenInvalid(b, truth);
  const image::Mask mask = image::unionOf(image::objectMask(truth), image::objectMask(rendered));
  flip_ += evaluation::meanOver(evaluation::flip(a, b), evaluation::validPart(mask, truth));
}

Agreement PooledAgreement::agreement() const {
  return {difference_.psnrLinear(), difference_.psnrSrgb(), difference_.ssim(), flip_.mean()};
}

void RelativeRms::add(const image::Image& a, const image::Image& b) {
  assert(a.values.size() == b.values.size() && a.channels == 4);
  for (size_t i = 0; i < a.values.size(); ++i) {
    if (i % 4 == 3) continue;
    const double reference = b.values[i], difference = a.values[i] - reference;
    difference_ += difference * difference;
    reference_ += reference * reference;
  }
}

double RelativeRms::value() const { return difference_ == 0 ? 0 : std::sqrt(difference_ / reference_); }

Panel panelOf(const Sample& sample, const image::Image& rendered, double exposure) {
  constexpr int kLargestSide = 360; // pixels
  const image::Image truth = evaluation::applyExposure(sample.truth, exposure);
  const image::Image picture = evaluation::applyExposure(rendered, exposure);
  const image::Image error = evaluation::flip(truth, picture);
  image::Image colors(error.width, error.height, 3);
  for (size_t i = 0; i < error.values.size(); ++i) {
    const Rgb color = evaluation::errorColor(error.values[i]);
    colors.values[3 * i] = color.r, colors.values[3 * i + 1] = color.g, colors.values[3 * i + 2] = color.b;
  }
  const image::PixelWindow window =
      windowAround(image::unionOf(image::objectMask(truth), image::objectMask(picture)));
  const double shrink =
      std::min(1.0, static_cast<double>(kLargestSide) / std::max(window.width(), window.height()));
  const auto resampled = [&](const image::Image& image) {
    const auto side = [&](int pixels) { return std::max(1, static_cast<int>(std::lround(shrink * pixels))); };
    return image::resampled(image, window, side(window.width()), side(window.height()));
  };
  return {0, sample.name, pngOf(evaluation::srgbEncoded(resampled(truth))),
          pngOf(evaluation::srgbEncoded(resampled(picture))), pngOf(resampled(colors))};
}

} // namespace surflect::chart
