// Rendered layers as a screen shows them: exposure, tone curve and background, or an AOV in colours; encoded
// as JPEG for the page.
#pragma once

#include "render/method/renderer.h"
#include "srf/image/image.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <string>
#include <vector>

namespace surflect::viewer {

// A picture as screens show it: sRGB, 8 bits, rows from the top.
struct DisplayPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb; // 3 * width * height
};

enum class Tone {
  none,  // clipped at white
  filmic // rolls off towards white [Hable 2010]
};

// How radiance becomes the colours of a screen.
struct DisplayOptions {
  double exposureStops = 0;
  double white = 1; // radiance of white at 0 stops
  Tone tone = Tone::none;
  Rgb background; // as displayed, 0..1
};

// Curve of linear light relative to white. Filmic: f(2 x) / f(11.2), f(x) = (x (0.15 x + 0.05) + 0.004) /
// (x (0.15 x + 0.5) + 0.06) - 1/15.
// [Hable 2010] Hable: Uncharted 2: HDR Lighting. Game Developers Conference.
float toned(float linear, Tone tone);

// Colour over the background. color: RGBA radiance, premultiplied.
DisplayPicture shownColor(const image::Image& color, const DisplayOptions& options);

// A preview over a background: RGBA as displayed, with straight alpha. Blended in linear light.
DisplayPicture overBackground(const image::Image& preview, const Rgb& background);

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
