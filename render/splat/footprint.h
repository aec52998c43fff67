// Footprint of a splat on the screen, in plain numbers that vector kernels may include.
#pragma once

#include <cstdint>

namespace surflect::splat {

// Cut-off of a Gaussian, in standard deviations; 0.2 % of its mass lies beyond.
constexpr double kCutoffSigmas = 3.5;

// A splat is not drawn if its cut-off circle comes nearer to the viewer than this fraction of its centre's
// depth: its image would no longer resemble a Gaussian, and its size would be unbounded.
constexpr double kNearestDepthFraction = 0.1;
// Largest distance of the surface from its splat's plane, in units of s (splat.h).
constexpr double kMaxSurfaceDeviation = 0.15;
// Largest difference in depth between splats of one plane, in standard deviations.
constexpr double kDepthSigmas = 2;

// Covered area of a pixel from which it is fully opaque; see saturated() in raster_tile.h. Opacity is
// symmetric about an area of 1/2, so that outlines stay in place, and flat at both ends, so that the ripple
// of the sum leaves no holes, and stray tails of splats leave no haze. It reaches 1 at 0.71 standard
// deviations inside a straight border; two pixels inside an outline the area can be as low as 0.74, where
// sharp edges meet.
constexpr float kOpaqueArea = 0.7f;

// Area from which a layer no longer extends further back: the tails of its splats, where the surface has bent
// away from their planes, must not connect it to a second sheet close behind.
constexpr float kLayerAnchorArea = 0.5f;

// Number of times that the nearest layer is extended if SplatOptions::searchLayers is false.
constexpr int kLayerGrowths = 2;

// Peak of the kernel (1 - q/Q)^2 over which a splat's covered area is spread, Q being the square of the
// cut-off. 6/Q gives it the mass of exp(-q/2): their integrals over the plane are pi Q / 3 and 2 pi.
constexpr float kAreaPeak = static_cast<float>(6 / (kCutoffSigmas * kCutoffSigmas));

// Pixels [x0, x1) x [y0, y1).
struct PixelBox {
  int x0, y0, x1, y1;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
};

// Footprint of a splat, low-pass included. At (dx, dy) pixels from its centre, where
//   q = xx (dx + skew dy)^2 + yy dy^2 <= kCutoffSigmas^2,
// its Gaussian is peak exp(-q/2), and its order is order + orderX dx + orderY dy, within the tolerance.
struct Footprint {
  float x, y;         // centre, pixels
  float xx, skew, yy; // xx and yy in 1/pixels^2
  float peak;
  float order, orderX, orderY;
  float tolerance; // half width of the depth interval, in order
  PixelBox box;    // pixels it may touch, clipped to the image; empty if it is not drawn
};

enum class Rejection : uint8_t {
  dead,       // degenerate frame after the warp
  notFinite,  // non-finite number; or no area, radius or coverage
  backFacing, // outward normal away from the viewer
  tooNear,    // reaches the near plane or the plane of the viewer
  outside,    // outside the image
};

} // namespace surflect::splat
