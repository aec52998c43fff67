#include "render/film/display.h"

#include "srf/image/color.h"
#include "srf/image/image_file.h"
#include "srf/image/png.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace surflect::film {

namespace {

constexpr size_t kPixelsAtOnce = 1 << 14;

// 0 for what is not a number.
float clipped(float light) { return light > 0 ? std::min(light, 1.f) : 0; }

// Light of a screen from straight radiance of `pixels` pixels, RGB: relative to white before, 0..1 after.
void tone(std::span<float> rgb, const DisplayOptions& options) {
  if (options.tone == scene::Tone::ocio) {
    options.ocio->apply(rgb);
    for (float& value : rgb) value = image::linearFromSrgb(clipped(value));
    return;
  }
  for (float& value : rgb) value = clipped(toned(value, options.tone));
}

// Linear light of a picture file, RGB over black.
image::Image readLinear(const std::filesystem::path& path) {
  const image::Picture picture = image::readPicture(path);
  if (picture.orientation != 1)
    throw Error("is turned or mirrored by its EXIF orientation: save it upright").in(path);
  const image::Transfer usual{picture.isFloat() ? image::Transfer::Curve::linear
                                                : image::Transfer::Curve::srgb};
  if (picture.color && !picture.color->problem.empty())
    throw Error(picture.color->problem).at(picture.color->source).in(path);
  const image::Image& stored = picture.image;
  const bool isGrey = stored.channels < 3, hasAlpha = picture.hasAlpha();
  const auto pixels = static_cast<size_t>(stored.width) * static_cast<size_t>(stored.height);
  const auto stride = static_cast<size_t>(stored.channels);
  image::Image colors(stored.width, stored.height, isGrey ? 1 : 3);
  const auto channels = static_cast<size_t>(colors.channels);
  const auto alphaAt = [&](size_t i) { return clipped(stored.values[i * stride + channels]); };
  for (size_t i = 0; i < pixels; ++i)
    for (size_t c = 0; c < channels; ++c) {
      const float value = stored.values[i * stride + c];
      const bool isDivided = picture.alphaPremultiplied && hasAlpha && alphaAt(i) > 0;
      colors.values[i * channels + c] = isDivided ? value / alphaAt(i) : value;
    }
  image::Image linear =
      image::decoded(colors, {picture.color ? picture.color->encoding : image::ColorEncoding{}, usual});
  for (size_t i = 0; i < pixels; ++i)
    for (size_t c = 0; c < 3; ++c) {
      float& value = linear.values[3 * i + c];
      value = clipped(value) * (hasAlpha ? alphaAt(i) : 1);
    }
  return linear;
}

} // namespace

float toned(float linear, scene::Tone tone) {
  if (tone != scene::Tone::filmic) return linear;
  const auto f = [](float x) {
    return (x * (0.15f * x + 0.05f) + 0.004f) / (x * (0.15f * x + 0.5f) + 0.06f) - 1 / 15.f;
  };
  return f(2 * std::clamp(linear, 0.f, 65504.f)) / f(11.2f); // the largest half; infinite would be no number
}

namespace {

// Encoders of samples, which turn light and alpha into codes.
struct Samples8 {
  static void setLight(uint8_t* sample, float light) {
    static const image::SrgbBytes bytes;
    *sample = bytes(light);
  }
  static void set(uint8_t* sample, float value) {
    *sample = static_cast<uint8_t>(image::quantized(value, 255));
  }
};
struct Samples16 {
  static void setLight(uint8_t* sample, float light) { set(sample, image::srgbFromLinear(clipped(light))); }
  static void set(uint8_t* sample, float value) {
    const uint16_t code = image::quantized(value, 65535);
    sample[0] = static_cast<uint8_t>(code), sample[1] = static_cast<uint8_t>(code >> 8);
  }
};

// shadow: as in FrameLayers.
template <class Samples>
DisplayPicture shown(const image::Image& color, const image::Image& shadow, const DisplayOptions& options) {
  const auto scale = static_cast<float>(std::exp2(options.exposureStops) / options.white);
  const size_t pixels = color.values.size() / 4, channels = options.isTransparent ? 4 : 3,
               size = static_cast<size_t>(options.bits) / 8;
  const image::Image* const backdrop = options.backdrop.get();
  const float background[] = {options.background.r, options.background.g, options.background.b};
  float behind[3];
  std::array<uint8_t, 8> empty{};
  for (size_t c = 0; c < 3; ++c) {
    behind[c] = image::linearFromSrgb(background[c]);
    if (!options.isTransparent) Samples::set(&empty[c * size], background[c]);
  }
  DisplayPicture picture{color.width, color.height, std::vector<uint8_t>(channels * size * pixels),
                         static_cast<int>(channels), options.bits};
  tbb::parallel_for(
      tbb::blocked_range<size_t>(0, pixels, kPixelsAtOnce), [&](const tbb::blocked_range<size_t>& part) {
        std::vector<float> straight(3 * part.size());
        for (size_t i = part.begin(); i < part.end(); ++i) {
          const float* const pixel = &color.values[4 * i];
          const float factor = pixel[3] > 0 ? scale / std::min(pixel[3], 1.f) : scale;
          for (size_t c = 0; c < 3; ++c) straight[3 * (i - part.begin()) + c] = factor * pixel[c];
        }
        tone(straight, options);
        for (size_t i = part.begin(); i < part.end(); ++i) {
          const float* const light = &straight[3 * (i - part.begin())];
          const float* const pixel = &color.values[4 * i];
          const float alpha = clipped(pixel[3]);
          const float cover = shadow.values.empty() ? alpha : clipped(alpha + shadow.values[i]);
          const bool isObject = alpha > 0 || pixel[0] != 0 || pixel[1] != 0 || pixel[2] != 0;
          const float opacity = !isObject ? 0 : alpha > 0 ? alpha : 1; // light without alpha adds up
          uint8_t* const samples = &picture.bytes[channels * size * i];
          if (!isObject && cover == 0 && !backdrop) {
            std::copy_n(empty.begin(), channels * size, samples);
          } else if (options.isTransparent) {
            const float share = cover > alpha ? opacity / cover : isObject ? 1.f : 0.f;
            for (size_t c = 0; c < 3; ++c) Samples::setLight(samples + c * size, share * light[c]);
            Samples::set(samples + 3 * size, cover);
          } else {
            for (size_t c = 0; c < 3; ++c)
              Samples::setLight(samples + c * size, over(opacity * light[c], cover,
                                                         backdrop ? backdrop->values[3 * i + c] : behind[c]));
          }
        }
      });
  return picture;
}

DisplayPicture shownOver(const image::Image& color, const image::Image& shadow,
                         const DisplayOptions& options) {
  return options.bits == 16 ? shown<Samples16>(color, shadow, options)
                            : shown<Samples8>(color, shadow, options);
}

} // namespace

DisplayPicture shownColor(const image::Image& color, const DisplayOptions& options) {
  return shownOver(color, {}, options);
}

DisplayPicture shownColor(const method::FrameLayers& film, const DisplayOptions& options) {
  return shownOver(film.color, film.shadow, options);
}

std::string pngBytes(const DisplayPicture& picture) {
  assert(picture.bits == 8);
  return image::pngBytes(
      {picture.width, picture.height, picture.channels, 8, image::PngColors::srgb, picture.bytes});
}

FileStamp::FileStamp(std::filesystem::path file) : path(std::move(file)) {
  std::error_code problem;
  time = std::filesystem::last_write_time(path, problem);
  size = std::filesystem::file_size(path, problem);
}

Finish::Finish(const scene::Output& output, const std::filesystem::path& script) try : given_(output.finish) {
  if (given_.tone == scene::Tone::ocio) {
    if (const char* const configuration = std::getenv("OCIO")) stamps_.emplace_back(configuration);
    ocio_ = std::make_shared<const image::OcioView>(given_.ocioDisplay, given_.ocioView);
    identity_ += " ocio " + hex(ocio_->hash());
  }
  if (const auto* path = std::get_if<std::filesystem::path>(&given_.background)) {
    try {
      stamps_.emplace_back(*path);
      auto picture = std::make_shared<const image::Image>(readLinear(*path));
      const int width = picture->width, height = picture->height;
      if (std::abs(int64_t{output.width} * height - int64_t{output.height} * width) >
          std::max(output.width, width))
        throw Error::mismatch("a picture of the frames' shape, " + sizeText(output.width, output.height),
                              sizeText(width, height))
            .in(*path);
      identity_ += " background " + hex(contentHash(std::as_bytes(std::span(picture->values))));
      picture_ = std::move(picture);
    } catch (const Error& error) {
      throw Error(error.what()).at("background");
    }
  }
} catch (Error& error) {
  throw std::move(error).at("output").in(script);
}

DisplayOptions Finish::optionsFor(int width, int height) const {
  DisplayOptions options{.tone = given_.tone, .background = {}, .backdrop = {}, .ocio = ocio_};
  options.isTransparent = std::holds_alternative<std::monostate>(given_.background);
  if (const auto* color = std::get_if<Rgb>(&given_.background)) options.background = *color;
  if (!picture_) return options;
  const auto fits = [&](const auto& picture) {
    return picture && picture->width == width && picture->height == height;
  };
  const std::lock_guard lock(sizing_);
  if (!fits(sized_))
    sized_ = fits(picture_) ? picture_
                            : std::make_shared<const image::Image>(image::resampled(
                                  *picture_, {0, 0, picture_->width, picture_->height}, width, height));
  options.backdrop = sized_;
  return options;
}

bool Finish::isCurrent() const {
  return std::ranges::all_of(stamps_, [](const FileStamp& stamp) { return stamp == FileStamp(stamp.path); });
}

} // namespace surflect::film
