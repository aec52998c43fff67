#include "apps/viewer/display.h"

#include "render/evaluation/flip.h"
#include "surfel/base/error.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

namespace surflect::viewer {

namespace {

using Bytes = std::array<uint8_t, 3>;

uint8_t byteOf(float displayed) {
  return static_cast<uint8_t>(std::lround(255 * std::clamp(displayed, 0.f, 1.f)));
}

Bytes bytesOf(const Rgb& displayed) {
  return {byteOf(displayed.r), byteOf(displayed.g), byteOf(displayed.b)};
}

// A picture whose pixel i has the bytes pixelOf(i).
template <class PixelOf> DisplayPicture pictureOf(int width, int height, const PixelOf& pixelOf) {
  DisplayPicture picture{width, height, {}};
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  picture.bytes.resize(3 * pixels);
  tbb::parallel_for(tbb::blocked_range<size_t>(0, pixels, 1 << 14),
                    [&](const tbb::blocked_range<size_t>& part) {
                      for (size_t i = part.begin(); i < part.end(); ++i) {
                        const Bytes bytes = pixelOf(i);
                        std::copy(bytes.begin(), bytes.end(), &picture.bytes[3 * i]);
                      }
                    });
  return picture;
}

float scaleOf(const DisplayOptions& options) {
  return static_cast<float>(std::exp2(options.exposureStops) / options.white);
}

// `displayed` over the background, by alpha.
Bytes blended(const Rgb& displayed, float alpha, const Rgb& background) {
  const float a = std::clamp(alpha, 0.f, 1.f);
  return bytesOf(a * displayed + (1 - a) * background);
}

} // namespace

DisplayPicture shownAov(const method::FrameLayers& layers, const std::string& aov,
                        const Point3<AcquisitionSpace, double>& middle, double radius,
                        const DisplayOptions& options) {
  const auto found = layers.aovs.find(aov);
  if (found == layers.aovs.end()) throw Error::mismatch("an AOV of the model", '"' + aov + '"').at("show");
  const image::Image& image = found->second;
  const auto alphaAt = [&](size_t i) { return layers.color.values[4 * i + 3]; };
  const auto shown = [&](const auto& colorOf) {
    return pictureOf(image.width, image.height, [&](size_t i) -> Bytes {
      const float alpha = alphaAt(i);
      const float* const values = &image.values[i * static_cast<size_t>(image.channels)];
      return alpha > 0 ? blended(colorOf(values, alpha), alpha, options.background)
                       : bytesOf(options.background);
    });
  };
  if (aov == "depth") { // infinite off the object
    float near = std::numeric_limits<float>::infinity(), far = 0;
    for (const float depth : image.values)
      if (std::isfinite(depth)) near = std::min(near, depth), far = std::max(far, depth);
    return shown([&](const float* depth, float) {
      const float light = far > near ? 1 - 0.9f * (*depth - near) / (far - near) : 1;
      return Rgb{light, light, light};
    });
  }
  if (aov == "normal")
    return shown([](const float* n, float alpha) {
      const auto channel = [&](int k) { return 0.5f + 0.5f * n[k] / alpha; };
      return Rgb{channel(0), channel(1), channel(2)};
    });
  if (aov == "rest" || aov == "position")
    return shown([&](const float* place, float alpha) {
      const auto channel = [&](int k) {
        return static_cast<float>(0.5 + 0.5 * (place[k] / alpha - middle.raw()[k]) / radius);
      };
      return Rgb{channel(0), channel(1), channel(2)};
    });
  if (image.channels == 3)
    return shown([](const float* color, float alpha) {
      return Rgb{color[0] / alpha, color[1] / alpha, color[2] / alpha};
    });
  // Stretch 1 is black, 8 and more light yellow; an error of a quarter of white likewise.
  const bool isStretch = aov == "stretch";
  const float scale = 4 * scaleOf(options);
  return shown([&](const float* value, float alpha) {
    const float plain = *value / alpha;
    return evaluation::errorColor(isStretch ? std::log2(std::max(plain, 1.f)) / 3 : scale * plain);
  });
}

DisplayPicture shownError(const image::Image& a, const image::Image& b, const DisplayOptions& options) {
  const float scale = scaleOf(options);
  return pictureOf(a.width, a.height, [&](size_t i) -> Bytes {
    const float* const left = &a.values[4 * i];
    const float* const right = &b.values[4 * i];
    if (!(left[3] > 0) && !(right[3] > 0)) return bytesOf(options.background);
    float largest = 0;
    for (int c = 0; c < 3; ++c) {
      const auto shown = [&](const float* pixel) { return std::clamp(scale * pixel[c], 0.f, 1.f); };
      largest = std::max(largest, std::abs(shown(left) - shown(right)));
    }
    return bytesOf(evaluation::errorColor(4 * largest));
  });
}

std::string jpegBytes(const DisplayPicture& picture, JpegQuality quality) {
  const bool isStill = quality == JpegQuality::still;
  const std::unique_ptr<void, decltype(&tjDestroy)> encoder(tjInitCompress(), &tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed =
      encoder
          ? tjCompress2(encoder.get(), picture.bytes.data(), picture.width, 0, picture.height, TJPF_RGB,
                        &bytes, &size, isStill ? TJSAMP_444 : TJSAMP_420, isStill ? 95 : 80, TJFLAG_FASTDCT)
          : -1;
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owned(bytes, &tjFree);
  if (failed != 0) throw Error(std::string("a picture cannot be encoded as JPEG: ") + tjGetErrorStr());
  return {reinterpret_cast<const char*>(bytes), size};
}

} // namespace surflect::viewer
