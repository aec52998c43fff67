// Mask files: how much of each pixel is the object.
#pragma once

#include "srf/image/image_file.h"

#include <filesystem>
#include <string>

namespace surflect::capture {

struct MaskContent {
  image::Image coverage; // 1 channel, 0..1
  float white = 1;       // the stored value that was taken for full coverage
};

// White keeps all of a pixel, black and transparent nothing. Where a mask with alpha is a cut-out of the
// photograph, or all one colour, its alpha alone counts. Labels, whose brighter value is white: a mask of two
// values, 0 and one of at most 1/2; or the integer 1 in all pixels. `lossy`: values are not exact, so there
// are no labels.
MaskContent contentOf(const image::Picture& mask, bool lossy = false);

// A mask file in its own size, and its coverage in that of the pictures, to which masks of the same shape are
// resized by their mean over each pixel. Throws Error, also for another shape.
MaskContent readMask(const std::filesystem::path& mask);
image::Image readCoverage(const std::filesystem::path& mask, image::PictureSize size);

// Whether a picture of size `a` is one of size `b` made larger or smaller: the same shape but for rounding to
// whole pixels, and at least 5 % of difference, less than which is a crop.
bool isResized(image::PictureSize a, image::PictureSize b);

// "masks/a.png (640 x 480, values 0 to 3 of 255)", of a mask or of a picture with alpha, whose alpha is
// described, too. The layers are those of an EXR, as in Frame. Throws Error for what cannot be read.
std::string describeMatte(const std::filesystem::path& file, const std::string& layer = "",
                          const std::string& alphaLayer = "");

} // namespace surflect::capture
