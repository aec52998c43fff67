#include "srf/planes/plane_coder.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>

namespace surflect::planes {

PlaneRange rangeOf(std::span<const float> values) {
  if (values.empty()) return {};
  const auto [least, most] = std::ranges::minmax(values);
  return {least, most > least ? most : least + 1};
}

double stepsOf(int quality) { return quality < 50 ? 5000.0 / quality : 200 - 2.0 * quality; }

void shareSteps(std::span<PlaneRange> ranges, int quality) {
  float widest = 0;
  for (const PlaneRange& range : ranges) widest = std::max(widest, range.most - range.least);
  for (PlaneRange& range : ranges) {
    const double steps =
        stepsOf(quality) * static_cast<double>(widest) / static_cast<double>(range.most - range.least);
    const double shared = steps > 100 ? 5000 / steps : 100 - steps / 2;
    range.quality = std::clamp(static_cast<int>(std::lround(shared)), 1, 100);
  }
}

uint8_t byteOf(const PlaneRange& range, float value) {
  const float unit = (value - range.least) / (range.most - range.least);
  return static_cast<uint8_t>(std::lround(255 * std::clamp(unit, 0.f, 1.f)));
}

std::string greyJpeg(std::span<const uint8_t> grey, int width, int height, int quality) {
  assert(grey.size() == static_cast<size_t>(width) * static_cast<size_t>(height));
  const std::unique_ptr<void, decltype(&tjDestroy)> encoder(tjInitCompress(), &tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed = encoder
                         ? tjCompress2(encoder.get(), grey.data(), width, 0, height, TJPF_GRAY, &bytes, &size,
                                       TJSAMP_GRAY, quality, TJFLAG_ACCURATEDCT | TJFLAG_PROGRESSIVE)
                         : -1;
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owned(bytes, &tjFree);
  if (failed != 0) throw Error(std::string("a plane cannot be encoded as JPEG: ") + tjGetErrorStr());
  return {reinterpret_cast<const char*>(bytes), size};
}

std::vector<uint8_t> greyOf(std::string_view jpeg, int width, int height) {
  const std::unique_ptr<void, decltype(&tjDestroy)> decoder(tjInitDecompress(), &tjDestroy);
  const auto* const bytes = reinterpret_cast<const unsigned char*>(jpeg.data());
  int foundWidth = 0, foundHeight = 0, subsampling = 0, colors = 0;
  if (!decoder || tjDecompressHeader3(decoder.get(), bytes, jpeg.size(), &foundWidth, &foundHeight,
                                      &subsampling, &colors) != 0)
    throw Error(std::string("a plane is no JPEG: ") + tjGetErrorStr());
  if (foundWidth != width || foundHeight != height)
    throw Error::mismatch(sizeText(width, height), sizeText(foundWidth, foundHeight)).at("plane");
  std::vector<uint8_t> grey(static_cast<size_t>(width) * static_cast<size_t>(height));
  if (tjDecompress2(decoder.get(), bytes, jpeg.size(), grey.data(), width, 0, height, TJPF_GRAY,
                    TJFLAG_ACCURATEDCT) != 0)
    throw Error(std::string("a plane is damaged: ") + tjGetErrorStr());
  return grey;
}

} // namespace surflect::planes
