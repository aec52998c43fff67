#include "render/stage/texture.h"

#include "srf/image/image_file.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>

namespace surflect::stage {

namespace {

// i modulo n, non-negative also for negative i.
int wrapped(int i, int n) { return ((i % n) + n) % n; }

// Decoder by the picture's own statement; by default floating point is linear, all else sRGB.
image::ColorDecoder decoderOf(const image::Picture& picture, const std::filesystem::path& path) {
  const image::Transfer usual{picture.isFloat() ? image::Transfer::Curve::linear
                                                : image::Transfer::Curve::srgb};
  if (!picture.color) return {{}, usual};
  if (!picture.color->problem.empty()) throw Error(picture.color->problem).at(picture.color->source).in(path);
  return {picture.color->encoding, usual};
}

bool isUnit(float value) { return value >= 0 && value <= 1; }

Error inPixel(Error e, int x, int y, const std::filesystem::path& path) {
  return std::move(e).at("pixel[" + std::to_string(x) + ", " + std::to_string(y) + "]").in(path);
}

} // namespace

image::Image readTexels(const std::filesystem::path& path, Texels what) {
  const image::Picture picture = image::readPicture(path);
  const image::Image& image = picture.image;
  if (picture.hasAlpha() && picture.alphaPremultiplied)
    throw Error::mismatch("a texture without alpha", "colours multiplied by it").in(path);
  image::Image stored(image.width, image.height, image.channels < 3 ? 1 : 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < stored.channels; ++c) {
        const float value = image.at(x, y)[static_cast<size_t>(c)];
        if (!isUnit(value)) throw inPixel(Error::mismatch("0 to 1", numberText(value)), x, y, path);
        stored.at(x, y)[static_cast<size_t>(c)] = value;
      }
  constexpr float kRounding = 1e-4f; // tolerance for colour conversion, including a profile's white
  image::Image linear =
      image::decoded(stored, what == Texels::factors ? image::ColorDecoder() : decoderOf(picture, path));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (float& value : linear.at(x, y)) {
        const float inside = std::clamp(value, 0.f, 1.f);
        if (!(std::abs(value - inside) <= kRounding))
          throw inPixel(Error("the colour lies outside of Rec. 709's gamut (" + numberText(value) +
                              ", linear); convert the texture to sRGB"),
                        x, y, path);
        value = inside;
      }
  return linear;
}

Texture::Texture(std::shared_ptr<const image::Image> texels, int columns, int rows)
    : texels_(std::move(texels)), columns_(columns), rows_(rows) {
  assert(texels_ && texels_->channels == 3);
}

Rgb Texture::at(const Vec2<double>& st) const {
  const auto fraction = [](double x) { return x - std::floor(x); };
  const double x = fraction(st[0] * columns_) * texels_->width - 0.5,
               y = (1 - fraction(st[1] * rows_)) * texels_->height - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  const auto texel = [&](int dx, int dy) {
    const auto t = texels_->at(wrapped(static_cast<int>(left) + dx, texels_->width),
                               wrapped(static_cast<int>(top) + dy, texels_->height));
    return Rgb{t[0], t[1], t[2]};
  };
  const auto a = static_cast<float>(x - left), b = static_cast<float>(y - top);
  return (1 - b) * ((1 - a) * texel(0, 0) + a * texel(1, 0)) + b * ((1 - a) * texel(0, 1) + a * texel(1, 1));
}

} // namespace surflect::stage
