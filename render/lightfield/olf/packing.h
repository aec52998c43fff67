// Views cropped to the object's box and packed into an array texture.  [Vlasic 2003, §4.2]
#pragma once

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/opacity_field.h"
#include "srf/image/image.h"
#include "srf/image/resize.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <span>
#include <vector>

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
  double cutOffShare = 0;    // of blocks: visible texels that are brighter than white
};

struct PackingOptions {
  size_t budget;     // bytes of the packed views
  bool s3tc = false; // blocks in place of half floats
};

// Pictures of the given views. They have their full size if they fit into the budget; otherwise all are
// scaled down by one factor until they do. Reads each picture twice. Throws Error if a picture cannot be
// read, or if the budget leaves less than a texel, or a block, for each view; and Cancelled.
PackedViews packViews(const lightfield::Views& views, std::span<const size_t> training,
                      const PackingOptions& options, PackingReport& report, const Progress& progress = {});

// Radiance below which 99.5 % of a texel's largest channel over its alpha lie, where alpha is above 1/2; 1 if
// that is 0.
double whiteLevel(std::span<const Texel> texels);

// S3TC blocks of a view.  [Vlasic 2003, §7]
struct ViewBlocks {
  float white = 1;                // PackedView::white
  size_t visible = 0, cutOff = 0; // texels of alpha 1/8 or more; those of them that are brighter than white
  std::vector<uint8_t> blocks;
};

// Blocks of width x height texels (multiples of 4). White is the largest colour of texels that are visible,
// and at most four white levels: a few bright texels do not take all codes. Colours of transparent texels,
// which interpolation reads at outlines, are those around them; blocks fit colours by their alpha.
ViewBlocks viewBlocks(std::vector<Texel> texels, int width, int height);

} // namespace surflect::olf
