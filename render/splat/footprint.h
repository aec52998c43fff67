// A splat as it is drawn, in plain numbers: what vector kernels (surfel/math/simd.h) may include.
#pragma once

#include <cstdint>

namespace surflect::splat {

// Where a Gaussian is cut off; 0.2 % of its mass lies beyond.
constexpr double kCutoffSigmas = 3.5;

// A splat whose cut-off circle comes nearer than this part of its centre's depth is not drawn: beyond, its
// image is no longer anything like a Gaussian, and its size has no bound.
constexpr double kNearestDepthFraction = 0.1;
// How far, in s, the surface may leave the plane of its splat.
constexpr double kBend = 0.15;
// How many standard deviations apart the splats of one plane may lie in depth.
constexpr double kDepthSigmas = 2;

// How opaque a pixel is that is covered by this much area. Symmetric about 1/2, so outlines stay where they
// are; flat at both ends, so that the ripple of the sum leaves no holes and stray tails leave no haze. Inside
// of a straight border it is 1 from 0.71 standard deviations of the splats on; two pixels inside of an
// outline the sum can be as low as 0.74, where sharp edges meet.
constexpr float kFull = 0.7f;

// A layer with this much area no longer reaches further back than it does: the skirts of its splats, where
// the surface has bent away from their planes, must not lead to a second sheet close behind.
constexpr float kRooted = 0.5f;

// The area that a splat covers is spread over the pixels as (1 - q/Q)^2, Q the square of the cut-off, scaled
// to the mass of exp(-q/2): 6/Q at its peak; their integrals over the plane are pi Q / 3 and 2 pi.
constexpr float kAreaPeak = static_cast<float>(6 / (kCutoffSigmas * kCutoffSigmas));

// Pixels [x0, x1) x [y0, y1).
struct PixelBox {
  int x0, y0, x1, y1;
  bool empty() const { return x0 >= x1 || y0 >= y1; }
};

// A splat as it is drawn, low-pass included. At (dx, dy) pixels from its centre, where
//   q = xx (dx + skew dy)^2 + yy dy^2 <= kCutoffSigmas^2,
// its Gaussian is peak exp(-q/2), and it lies at order + orderX dx + orderY dy, give or take the tolerance.
struct Footprint {
  float x, y;         // centre, pixels
  float xx, skew, yy; // xx and yy in 1/pixels^2
  float peak;
  float order, orderX, orderY;
  float tolerance; // of the order
  PixelBox box;    // the pixels it may touch, clipped to the image; empty: not drawn
};

enum class Rejection : uint8_t {
  dead,       // the warp left it no frame
  notFinite,  // a number that is not finite, or no area, radius or coverage
  backFacing, // outward normal away from the viewer
  tooNear,    // reaches the near plane or the plane of the viewer
  outside,    // off the image
};

} // namespace surflect::splat
