// Views cropped to the object's box and packed into an array texture.  [Vlasic 2003, §4.2]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/opacity_field.h"
#include "srf/image/image.h"
#include "srf/image/resize.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <span>

namespace surflect::olf {

// Smallest window that holds the pixels with alpha above 0 and a pixel around them, within the picture. A
// picture without such pixels has its first pixel.
image::PixelWindow objectWindow(const image::Image& rgba);

// Gives pixels with a channel that is NaN the mean of their neighbours that have none; transparent black
// where all have.
void mendInvalid(image::Image& rgba);

struct PackingReport {
  uint64_t pictureBytes = 0; // of whole pictures, 8 for each pixel
  double scale = 1;          // of the packed pictures' sides
};

// Pictures of the given views. Halves of the full size if they fit into `budget` bytes; otherwise all are
// scaled down by one factor until they do. Reads each picture twice. Throws Error if a picture cannot be
// read, or if the budget leaves less than a texel for each view; and Cancelled.
PackedViews packViews(const lightfield::Views& views, std::span<const size_t> training, size_t budget,
                      PackingReport& report, const Progress& progress = {});

} // namespace surflect::olf
