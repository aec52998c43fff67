// Mask files: how much of each pixel is the object.
#pragma once

#include "srf/image/image_file.h"

#include <filesystem>
#include <string>

namespace surflect {

struct MaskContent {
  Image coverage;  // 1 channel, 0..1
  float white = 1; // the value that stood for all of a pixel
};

// White keeps all of a pixel, black and transparent nothing. Where a mask with alpha is a cut-out of the
// photograph, or all one colour, its alpha alone counts. In a mask of two values, 0 and one of at most 1/2,
// as pictures of labels 0 and 1 are, the brighter one is white.
MaskContent contentOf(const Picture& mask);

// A mask file in its own size, and its coverage in that of the pictures, to which masks of the same shape are
// resized by their mean over each pixel. Throws Error, also for another shape.
MaskContent readMask(const std::filesystem::path& mask);
Image readCoverage(const std::filesystem::path& mask, PictureSize size);

// Whether a picture of size `a` is one of size `b` made larger or smaller: the same shape but for rounding to
// whole pixels, and at least 5 % of difference, less than which is a crop.
bool isResized(PictureSize a, PictureSize b);

// "masks/a.png (640 x 480, values 0 to 3 of 255)", of a mask or of a picture with alpha, whose alpha is
// described, too.
std::string describeMatte(const std::filesystem::path& file);

} // namespace surflect
