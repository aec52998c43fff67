// Mask files: the share of each pixel that the object covers.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image_file.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace surflect::capture {

struct MaskContent {
  image::Image coverage; // 1 channel, 0..1
  float white = 1;       // stored value of full coverage
};

// Coverage from a mask picture. White covers a pixel, black and transparent do not. If a mask with alpha is a
// cut-out of the photograph, or has one colour, only alpha counts. The brighter one of two levels is white,
// whatever its value, unless the darker one is above 1/2: of two values; of many, if nearly all of the object
// has the brightest one, above 1/2, and the others are its edges. The integer 1 everywhere is white too.
// `lossy`: values are inexact, so a level is a range of them.
MaskContent contentOf(const image::Picture& mask, bool lossy = false);

// Reads a mask file in its own size. Throws Error.
MaskContent readMask(const std::filesystem::path& mask);
// Coverage of a mask file in the size of the pictures; a mask of another size is resized, by its mean over
// each pixel. Throws Error, also if the mask has another shape than the pictures.
image::Image readCoverage(const std::filesystem::path& mask, image::PictureSize size);

// Returns whether the header of a frame's picture states alpha; of an EXR, in the frame's layer. Throws
// Error.
bool hasAlpha(const std::filesystem::path& picture, const Frame& frame);

// Returns whether size `a` is size `b` enlarged or reduced: the same shape up to rounding to whole pixels,
// with at least 5 % of difference. Smaller differences are crops.
bool isResized(image::PictureSize a, image::PictureSize b);

// Description of a mask, or of a picture with alpha, whose alpha is described too: "masks/a.png (640 x 480,
// values 0 to 3 of 255)". Layers are those of an EXR, as in Frame. Throws Error if the file cannot be read.
std::string describeMatte(const std::filesystem::path& file, const std::string& layer = "",
                          const std::string& alphaLayer = "");

// Checks all masks of a capture before it is used, and reports to people.

// Sentences without a full stop, with counts and the first names.
struct MaskSurvey {
  std::vector<std::string> warnings; // probable mistakes: views without a mask beside views with one; masks
                                     // without object; captures whose masks have no background; masks that
                                     // look inverted; photographs whose matte differs from that of their view
  std::vector<std::string> notes;    // how masks were interpreted: as labels, as resized
};

// Reads all masks or `most`, evenly chosen, several at a time, and headers of pictures that have none; and
// the mattes of views (`most`, and of each at most as many photographs) whose photographs have their
// own. Masks look inverted if the border of the pictures is mostly white, and black at least twice as rare
// there as in the whole picture. `inverted`: black is the object. Throws Error for unreadable files, and
// Cancelled.
MaskSurvey surveyMasks(const Capture& capture, bool inverted, const Progress& progress,
                       size_t most = std::numeric_limits<size_t>::max());

// Description by describeMatte() of the first mask or picture with alpha, for messages; none if the capture
// has no mattes.
std::optional<std::string> describeFirstMatte(const Capture& capture);

} // namespace surflect::capture
