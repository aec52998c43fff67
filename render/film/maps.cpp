#include "render/film/maps.h"

#include "srf/image/color.h"
#include "surfel/base/error.h"

#include <tbb/parallel_for.h>

#include <cassert>
#include <cmath>
#include <vector>

namespace surflect::film {

namespace {

image::PngSamples emptyMap(const image::Image& color, int channels) {
  assert(color.channels == 4);
  image::PngSamples map{.width = color.width, .height = color.height, .channels = channels, .bitDepth = 16};
  map.bytes.resize(map.rowBytes() * static_cast<size_t>(map.height));
  return map;
}

void setSample(image::PngSamples& map, size_t pixel, int channel, double value) {
  const uint16_t sample = image::quantized(static_cast<float>(value), 65535);
  const size_t at = 2 * (pixel * static_cast<size_t>(map.channels) + static_cast<size_t>(channel));
  map.bytes[at] = static_cast<uint8_t>(sample >> 8);
  map.bytes[at + 1] = static_cast<uint8_t>(sample);
}

float alphaAt(const image::Image& color, size_t pixel) { return color.values[4 * pixel + 3]; }

// Calls change(pixel) for all pixels, whole rows on one thread.
template <class Change> void forPixels(const image::Image& image, const Change& change) {
  const auto width = static_cast<size_t>(image.width);
  tbb::parallel_for(size_t{0}, static_cast<size_t>(image.height), [&](size_t row) {
    for (size_t pixel = row * width; pixel < (row + 1) * width; ++pixel) change(pixel);
  });
}

void keepFarthest(std::optional<double>& farthest, double height) {
  if (!farthest || std::abs(height) > std::abs(*farthest)) farthest = height;
}

} // namespace

image::PngSamples normalMap(const image::Image& color, const image::Image& normals,
                            const capture::Camera<ObjectSpace>& camera) {
  assert(normals.channels == 3);
  image::PngSamples map = emptyMap(color, 4);
  forPixels(color, [&](size_t pixel) {
    const float* n = &normals.values[3 * pixel];
    Vec3<double> inCamera = camera.cameraFromWorld.rotation() * Vec3<double>(n[0], n[1], n[2]);
    const double length = inCamera.norm(); // premultiplied by alpha
    const bool isObject = length > 0 && alphaAt(color, pixel) > 0;
    inCamera = isObject ? Vec3<double>(inCamera / length) : Vec3<double>::UnitZ();
    for (int axis = 0; axis < 3; ++axis) setSample(map, pixel, axis, 0.5 + 0.5 * inCamera[axis]);
    if (isObject) setSample(map, pixel, 3, alphaAt(color, pixel));
  });
  return map;
}

HeightMap heightMap(const image::Image& color, const image::Image& depth, const HeightRange& range,
                    const capture::Camera<ObjectSpace>& camera) {
  assert(depth.channels == 1 && range.radius > 0);
  HeightMap map{emptyMap(color, 2), std::nullopt};
  const double depthOfMiddle = -camera.cameraFromWorld(range.middle).z();
  std::vector<std::optional<double>> farthest(static_cast<size_t>(color.height)); // of each row
  const auto width = static_cast<size_t>(color.width);
  forPixels(color, [&](size_t pixel) {
    const double z = depth.values[pixel];
    if (!std::isfinite(z) || !(alphaAt(color, pixel) > 0)) return;
    const double height = depthOfMiddle - z;
    setSample(map.samples, pixel, 0, 0.5 + 0.5 * height / range.radius);
    setSample(map.samples, pixel, 1, alphaAt(color, pixel));
    keepFarthest(farthest[pixel / width], height);
  });
  for (const auto& height : farthest)
    if (height) keepFarthest(map.farthest, *height);
  map.samples.texts = {{"height of black", numberText(-range.radius)},
                       {"height of white", numberText(range.radius)}};
  return map;
}

image::PngSamples albedoMap(const image::Image& color) {
  image::PngSamples map = emptyMap(color, 4);
  map.colors = image::PngColors::srgb;
  forPixels(color, [&](size_t pixel) {
    const float alpha = alphaAt(color, pixel);
    if (!(alpha > 0)) return;
    for (int c = 0; c < 3; ++c)
      setSample(map, pixel, c,
                image::srgbFromLinear(color.values[4 * pixel + static_cast<size_t>(c)] / alpha));
    setSample(map, pixel, 3, alpha);
  });
  return map;
}

} // namespace surflect::film
