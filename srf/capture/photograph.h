// Pixels of a capture, as linear radiance with Rec. 709 primaries and white.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/color.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace surflect::capture {

// Colour encoding of a capture's pictures: by the capture, else by each picture's file, else by its format.

// Default encoding of pictures: 8 bits are sRGB, all others linear. Bits as in Picture.
image::Transfer usualTransfer(int bits);

// Throws Error naming the picture if the statement of its file applies but cannot be understood.
image::ColorEncoding encodingOf(const std::optional<ColorSpace>& ofCapture,
                                const std::optional<image::ColorStatement>& ofFile,
                                const std::filesystem::path& picture);

// Radiance and alpha of one frame, both of the size of the view's lens.
struct Photograph {
  image::Image radiance; // 3 channels in the photograph's scale: linear, divided by alpha and exposure,
                         // brackets merged. Negative noise is kept. Black where alpha is 0.
  image::Image alpha; // 1 channel, 0..1: alpha (of a bracket's first picture) times mask, of integers or with
                      // a mask as settledAlpha() takes it; 1 if neither exists
  bool hasMatte = false;                  // the picture has alpha, or a mask
  std::vector<size_t> invalidTexels = {}; // texels that were NaN or infinite, in rising order; now black
};

// Photographs of the given frames (indices into capture.frames), in that order. Each file is opened and
// decompressed once, so ask for all frames of a view together, whose lights often share a file. Memory: 16
// bytes per pixel and frame; while reading also 4 per mask, and up to 32, or 44 with an ICC profile, for each
// picture of the files being read (readingBytes), and of incomplete brackets. Throws Error naming the faulty
// picture.
std::vector<Photograph> readPhotographs(const Capture& capture, std::span<const size_t> frames,
                                        const Progress& progress = {});

// All photographs of one view.
struct ViewPhotographs {
  std::vector<image::Image> radiance; // one per frame
  image::Image alpha;                 // matte of the view (matte_vote.h)
  bool hasMatte = false;              // true if any photograph has one
  size_t invalidTexels = 0;           // sum over the photographs
};

// Photographs of frames of one view, at 12.6 bytes per pixel and frame instead of 16. Where a photograph's
// own matte lacks what the view's shows, its colours are those beneath alpha 0, if they are straight;
// otherwise black. Empty without frames.
ViewPhotographs readViewPhotographs(const Capture& capture, std::span<const size_t> frames,
                                    const Progress& progress = {});

// Matte of the view as readViewPhotographs finds it, for frames of one view; none if no photograph has one,
// which headers tell. If no picture has alpha, only masks are read.
std::optional<image::Image> readViewMatte(const Capture& capture, std::span<const size_t> frames,
                                          const Progress& progress = {});

// Part of a view's photographs: some of their rows, or all of them at a smaller size.
struct ViewPart {
  int top = 0, rows = 0; // rows 0: from `top` to the last row
  int shrink = 1; // a texel is the mean of shrink x shrink pixels, or of as many as the picture has there
  const image::Image* matte = nullptr; // readViewMatte of all frames; null: none
};

// Lens of a view whose photographs are shrunk.
Lens shrunk(const Lens& lens, int shrink);

// Part of the photographs that readViewPhotographs would return, which differs only where alpha is below
// 1/16. Files are read whole.
ViewPhotographs readViewPart(const Capture& capture, std::span<const size_t> frames, const ViewPart& part,
                             const Progress& progress = {});

// Memory for the files that are read at the same time, at kBytesWhileRead for each of their pixels: a tenth
// of what this process may use, at least 2.5 GB. One file is always read. More is taken by all layers of a
// file, which are read together, and by pictures of a bracket, which wait for the last one.
double readingBytes();
inline constexpr double kBytesWhileRead = 48;

} // namespace surflect::capture
