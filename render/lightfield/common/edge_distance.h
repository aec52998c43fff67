// Distance of pixels to edges of a picture of the mesh: outlines and depth discontinuities.
//
// Symbols: a, b neighbouring pixels; t_a distance along the ray of a to the surface; h distance of the two
// rays there; s_a slope of the surface at a, the change of t from a to b in its tangent plane, per h.
#pragma once

#include "surfel/math/space.h"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace surflect::lightfield {

// Ray of a pixel, and where it meets the surface.
struct PixelHit {
  Point3<AcquisitionSpace, double> origin;
  Direction3<AcquisitionSpace, double> direction;             // unit
  double distance = std::numeric_limits<double>::quiet_NaN(); // NaN: the pixel shows background
  Vec3<double> normal = Vec3<double>::Zero();                 // of the surface; unit

  bool isSurface() const { return distance == distance; }
};

// Whether two neighbouring pixels show one continuous surface: (t_b - t_a) / h is s_a or s_b, up to a
// tolerance for curvature, or lies between the two, as across a crease. Slopes beyond 72 degrees do not widen
// this range: else every outline would pass for a crease.
bool isContinuous(const PixelHit& a, const PixelHit& b);

inline constexpr int kFarFromEdges = 3; // pixels
inline constexpr int kCodesPerPixel = 85;

// Distance of each pixel to the nearest pixel across an edge, in pixels times kCodesPerPixel; at most
// kFarFromEdges pixels. A pixel is at an edge if one of its eight neighbours shows background or is not
// continuous with it: its distance is 1 pixel. The distance of any other pixel is 1 more than that to the
// nearest pixel at an edge. Background has 0. Hits are those of a picture with rows of `width` pixels; beyond
// it there are no edges.
std::vector<uint8_t> edgeDistances(std::span<const PixelHit> hits, int width);

} // namespace surflect::lightfield
