// Mask files: the share of each pixel that the object covers.
#pragma once

#include "srf/image/image_file.h"

#include <filesystem>
#include <string>

namespace surflect::capture {

struct MaskContent {
  image::Image coverage; // 1 channel, 0..1
  float white = 1;       // stored value of full coverage
};

// Coverage from a mask picture. White covers a pixel, black and transparent do not. If a mask with alpha is a
// cut-out of the photograph, or has one colour, only alpha counts. Label images have two values, 0 and one of
// at most 1/2, or the integer 1 everywhere; their brighter value is white. `lossy`: values are inexact, so
// there are no labels.
MaskContent contentOf(const image::Picture& mask, bool lossy = false);

// Reads a mask file in its own size. Throws Error.
MaskContent readMask(const std::filesystem::path& mask);
// Coverage of a mask file in the size of the pictures; a mask of another size is resized, by its mean over
// each pixel. Throws Error, also if the mask has another shape than the pictures.
image::Image readCoverage(const std::filesystem::path& mask, image::PictureSize size);

// Returns whether size `a` is size `b` enlarged or reduced: the same shape up to rounding to whole pixels,
// with at least 5 % of difference. Smaller differences are crops.
bool isResized(image::PictureSize a, image::PictureSize b);

// Description of a mask, or of a picture with alpha, whose alpha is described too: "masks/a.png (640 x 480,
// values 0 to 3 of 255)". Layers are those of an EXR, as in Frame. Throws Error if the file cannot be read.
std::string describeMatte(const std::filesystem::path& file, const std::string& layer = "",
                          const std::string& alphaLayer = "");

} // namespace surflect::capture
