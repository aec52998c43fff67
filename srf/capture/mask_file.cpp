#include "srf/capture/mask_file.h"

#include "srf/capture/capture_keys.h"
#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/base/lower_case.h"
#include "surfel/base/message_text.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <ranges>
#include <span>

namespace surflect::capture {

namespace {

struct Texel {
  float white = 0, alpha = 1;
};

size_t texelCount(const image::Picture& mask) {
  return static_cast<size_t>(mask.image.width) * static_cast<size_t>(mask.image.height);
}

Texel texelOf(const image::Picture& mask, size_t i) {
  const auto channels = static_cast<size_t>(mask.image.channels);
  const float* values = mask.image.values.data() + i * channels;
  return {channels >= 3 ? image::luma({values[0], values[1], values[2]}) : values[0],
          mask.hasAlpha() ? values[channels - 1] : 1};
}

// Returns whether colours are a mask: nearly all opaque pixels are black or white, and some are white.
// Otherwise the picture is a cut-out of the object, or empty.
bool isStencil(const image::Picture& mask) {
  constexpr float kNear = 0.05f;
  constexpr double kShare = 0.95;
  size_t opaque = 0, white = 0, black = 0;
  for (size_t i = 0; i < texelCount(mask); ++i) {
    const auto [value, alpha] = texelOf(mask, i);
    if (!(alpha > 0.5f)) continue;
    ++opaque;
    white += value > 1 - kNear;
    black += value < kNear;
  }
  return white > 0 && static_cast<double>(white + black) >= kShare * static_cast<double>(opaque);
}

// White level of a label image: the brighter of two values, if the other is 0 and it is at most 1/2, or the
// only value, if it is the integer 1; otherwise 1.
float whiteOf(std::span<const float> values, int bits) {
  float other = 0;
  for (const float value : values) {
    if (value == 0 || value == other) continue;
    if (other != 0 || !(value > 0 && value <= 0.5f)) return 1;
    other = value;
  }
  const bool hasBlack = std::ranges::find(values, 0.f) != values.end();
  const bool isOne = bits > 0 && std::round(other * (std::exp2(bits) - 1)) == 1;
  return other > 0 && (hasBlack || isOne) ? other : 1;
}

struct Range {
  float least = std::numeric_limits<float>::infinity(), largest = -least;

  void add(float value) {
    least = std::min(least, value);
    largest = std::max(largest, value);
  }
  // Range of encoded values, "0 to 3 of 255".
  std::string shown(int bits) const {
    if (bits == 0) return numberText(least) + " to " + numberText(largest);
    const double top = std::exp2(bits) - 1;
    return numberText(std::round(least * top)) + " to " + numberText(std::round(largest * top)) + " of " +
           numberText(top);
  }
};

// Returns whether values may be inexact; WebP is lossless only optionally.
bool isLossy(const std::filesystem::path& file) {
  const std::string extension = lowerCase(file.extension().string());
  return extension == ".jpg" || extension == ".jpeg" || extension == ".jpe" || extension == ".webp";
}

image::Picture readLayer(const std::filesystem::path& file, const std::string& layer,
                         const std::string& alphaLayer) {
  if (image::formatOf(file) != image::PictureFormat::exr) return image::readPicture(file);
  const image::ExrFile exr(file);
  image::ChannelSet channels = image::colorChannels(exr, layer);
  if (const auto alpha = image::alphaChannel(exr, alphaLayer.empty() ? layer : alphaLayer))
    channels.push_back(*alpha);
  return {exr.read(channels), 0, true, exr.colorStatement()};
}

} // namespace

MaskContent contentOf(const image::Picture& mask, bool lossy) {
  const auto isOpen = [&](size_t i) { return !(texelOf(mask, i).alpha > 0.5f); };
  const bool hasHoles =
      mask.hasAlpha() && std::ranges::any_of(std::views::iota(size_t{0}, texelCount(mask)), isOpen);
  const bool alphaAlone = hasHoles && !isStencil(mask);
  MaskContent content{image::Image(mask.image.width, mask.image.height, 1)};
  std::vector<float>& values = content.coverage.values;
  for (size_t i = 0; i < values.size(); ++i) {
    const auto [white, alpha] = texelOf(mask, i);
    values[i] = alphaAlone ? alpha : mask.alphaPremultiplied ? white : white * alpha;
  }
  if (!lossy) content.white = whiteOf(values, mask.bits);
  if (content.white < 1)
    for (float& value : values) value /= content.white;
  return content;
}

MaskContent readMask(const std::filesystem::path& mask) {
  return contentOf(image::readPicture(mask), isLossy(mask));
}

image::Image readCoverage(const std::filesystem::path& mask, image::PictureSize size) {
  image::Image coverage = readMask(mask).coverage;
  const image::PictureSize found{coverage.width, coverage.height};
  if (found == size) return coverage;
  if (!isResized(found, size))
    throw Error::mismatch(sizeText(size.width, size.height) + " or of that shape",
                          sizeText(found.width, found.height))
        .at("size")
        .in(mask);
  return image::resampled(coverage, {0, 0, found.width, found.height}, size.width, size.height);
}

bool isResized(image::PictureSize a, image::PictureSize b) {
  const double wide = static_cast<double>(a.width) / b.width, high = static_cast<double>(a.height) / b.height;
  const bool isCrop =
      std::max(std::abs(wide - 1), std::abs(high - 1)) < 0.05 || a.width == b.width || a.height == b.height;
  // Smaller and larger size have the same shape if one side is the other, scaled and rounded.
  const auto& [small, large] = a.width < b.width ? std::pair(a, b) : std::pair(b, a);
  const double height = static_cast<double>(large.height) / large.width * small.width,
               width = static_cast<double>(large.width) / large.height * small.height;
  return !isCrop && (std::abs(height - small.height) <= 1 || std::abs(width - small.width) <= 1);
}

std::string describeMatte(const std::filesystem::path& file, const std::string& layer,
                          const std::string& alphaLayer) {
  const image::Picture picture = readLayer(file, layer, alphaLayer);
  Range white, alpha;
  for (size_t i = 0; i < texelCount(picture); ++i) {
    const Texel texel = texelOf(picture, i);
    white.add(texel.white);
    alpha.add(texel.alpha);
  }
  return file.string() + " (" + sizeText(picture.image.width, picture.image.height) + ", values " +
         white.shown(picture.bits) + (picture.hasAlpha() ? ", alpha " + alpha.shown(picture.bits) : "") + ")";
}

} // namespace surflect::capture
