// Frames as a screen shows them: exposure, tone curve, and what lies behind the object.
#pragma once

#include "render/method/renderer.h"
#include "render/scene/script.h"
#include "srf/image/image.h"
#include "srf/image/ocio.h"
#include "surfel/math/rgb.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace surflect::film {

// A picture as screens show it: sRGB, rows from the top.
struct DisplayPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> bytes; // channels * width * height samples
  int channels = 3;           // 3: opaque; 4: with straight alpha
  int bits = 8;               // of a sample; or 16, the low byte first
};

// How radiance becomes the colours of a screen.
struct DisplayOptions {
  double exposureStops = 0;
  double white = 1; // radiance of white at 0 stops
  scene::Tone tone = scene::Tone::none;
  Rgb background;             // as displayed, 0..1
  bool isTransparent = false; // alpha instead of the background
  int bits = 8;               // or 16
  std::shared_ptr<const image::Image>
      backdrop; // instead of the background's colour: linear RGB of the frame's size
  std::shared_ptr<const image::OcioView> ocio; // for Tone::ocio
};

// Curve of linear light relative to white. Filmic: f(2 x) / f(11.2), f(x) = (x (0.15 x + 0.05) + 0.004) /
// (x (0.15 x + 0.5) + 0.06) - 1/15.
// [Hable 2010] Hable: Uncharted 2: HDR Lighting. Game Developers Conference.
float toned(float linear, scene::Tone tone);

// Light of a pixel over what is behind it: C + (1 - a) B, with premultiplied C. [Porter and Duff 1984, §4.3]
// T. Porter, T. Duff: Compositing Digital Images.
inline float over(float premultiplied, float alpha, float behind) {
  return premultiplied + (1 - alpha) * behind;
}

// Colour over what lies behind it, in linear light; the tone curve is the object's alone. color: RGBA
// radiance, premultiplied.
DisplayPicture shownColor(const image::Image& color, const DisplayOptions& options);
// A frame's colour over its shadow. Straight alpha is that of both.
DisplayPicture shownColor(const method::FrameLayers& film, const DisplayOptions& options);

// PNG of a picture of 8 bits, tagged sRGB.
std::string pngBytes(const DisplayPicture& picture);

// Time and size of a file; none where it cannot be asked.
struct FileStamp {
  std::filesystem::path path;
  std::filesystem::file_time_type time;
  uintmax_t size = 0;

  explicit FileStamp(std::filesystem::path path);
  bool operator==(const FileStamp&) const = default;
};

// The finish of a script with what it names, read. Safe from many threads.
class Finish {
public:
  // `output` is the script's, `script` its path. Throws Error at the field: for a picture that cannot be read
  // or has another shape than the frames, and as OcioView does.
  Finish(const scene::Output& output, const std::filesystem::path& script);

  const scene::Finish& given() const { return given_; }

  // Options for frames of a size, at 0 stops and white 1.
  DisplayOptions optionsFor(int width, int height) const;

  // Whether the files that were read have the time and size that they had.
  bool isCurrent() const;

  // Text that tells the read files apart from others under the same names; empty if there are none.
  const std::string& identity() const { return identity_; }

private:
  scene::Finish given_;
  std::shared_ptr<const image::Image> picture_; // linear RGB
  std::shared_ptr<const image::OcioView> ocio_;
  std::string identity_;
  std::vector<FileStamp> stamps_;
  mutable std::mutex sizing_;
  mutable std::shared_ptr<const image::Image> sized_; // picture_ for the size that was asked for last
};

} // namespace surflect::film
