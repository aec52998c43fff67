// Blackout cone, view cone and screen rectangle of a texture region, by which rendering passes are culled.
// [Azuma 1999, §3.1]
//
// All are conservative: a pixel that shows the region sees it along a direction of its view cone, lies in its
// screen rectangle, and no pixel shows a region that isBackFacing().
#pragma once

#include "render/gl/framebuffer.h"
#include "render/lightfield/slf/chart.h"
#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

namespace surflect::slf {

// Cones of directions: an axis and the largest angle from it.

// All unit vectors within an angle of the axis; none where the axis is 0.
struct Cone {
  Vec3<double> axis = Vec3<double>::Zero(); // unit
  Angle halfAngle = Angle::fromRadians(0);

  bool isEmpty() const { return axis.isZero(0); }
};

// The cone of all directions.
inline Cone allDirections() { return {Vec3<double>::UnitZ(), Angle::fromRadians(std::numbers::pi)}; }

// In radians; exact also where directions, which need not be unit, are nearly equal or opposite.
double angleBetween(const Vec3<double>& a, const Vec3<double>& b);

// Smallest cone that holds two cones.
Cone coneAround(const Cone& a, const Cone& b);

// Cone of directions, at most 1 % wider than the smallest one. They need not be unit; those of length 0 are
// left out.
Cone coneAround(std::span<const Vec3<double>> directions);

// Cone of the normals of triangles. Triangles without area have no normal.
Cone normalCone(const TriangleMesh& mesh, std::span<const uint32_t> triangles);

inline constexpr size_t kPrismCorners = 16;

// Rasterisers round corners to 1/256 pixel. Small triangles at the silhouette that face away by at most this
// angle, in radians, may therefore turn over and be drawn.
inline constexpr double kTurnOver = 0.02;

// Directions to the viewer that are more than a right angle from all normals, so that no triangle is drawn.
// Empty if the normals span half the sphere, or there are none.
Cone blackoutCone(const Cone& normals);

struct RegionBound {
  std::array<Vec3<double>, kPrismCorners> corners; // of an octagonal prism around it; acquisition space
  Cone blackout;                                   // of its triangles; those without area are left out
};

// The chart must have triangles.
RegionBound boundOf(const TriangleMesh& mesh, const Chart& chart);

// Directions from a region to the viewer. Rays of pixels differ from it by rounding alone.
struct RegionView {
  // From the corners of the prism (viewOf), or along the corner rays of a pixel rectangle; unit, finite.
  std::vector<Vec3<double>> directions;
  Cone cone; // around them; all directions where the viewer is inside
};
RegionView viewOf(const RegionBound& bound, const Vec3<double>& viewer);

// Returns whether the viewer is so far behind all triangles of the region that none of them can be drawn: the
// blackout cone then holds the view cone.
bool isBackFacing(const RegionBound& bound, const RegionView& view);

// Pixels that can show the region, within the picture; empty if there are none. For pinholes.
std::optional<gl::Rect> screenRect(const RegionBound& bound, const capture::Camera<AcquisitionSpace>& camera);

} // namespace surflect::slf
