// Rendered layers as the page shows them: their colours, an AOV in colours, or an error; encoded as JPEG.
#pragma once

#include "render/film/display.h"
#include "render/method/renderer.h"
#include "srf/image/image.h"
#include "surfel/math/space.h"

#include <string>

namespace surflect::viewer {

using film::DisplayOptions;
using film::DisplayPicture;
using film::shownColor;
using scene::Tone;

// An AOV in colours over the background: depth from near (light) to far, directions as 0.5 + 0.5 n, places
// within the object's sphere, stretch and errors from black to light yellow. `alpha` is the last channel of
// `color`. Throws Error for an AOV that the layers lack.
DisplayPicture shownAov(const method::FrameLayers& layers, const std::string& aov,
                        const Point3<AcquisitionSpace, double>& middle, double radius,
                        const DisplayOptions& options);

// Differences of two pictures of radiance, from black to light yellow at a quarter of white, where either has
// alpha. Both RGBA of one size.
DisplayPicture shownError(const image::Image& a, const image::Image& b, const DisplayOptions& options);

enum class JpegQuality {
  moving, // quality 80 with halved colour resolution: small and fast
  still   // quality 95 with full colour resolution
};

// Throws Error if the picture cannot be encoded.
std::string jpegBytes(const DisplayPicture& picture, JpegQuality quality);

} // namespace surflect::viewer
