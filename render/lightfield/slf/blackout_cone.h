// Blackout cone, view cone and screen rectangle of a texture region, by which rendering passes are culled.
// [Azuma 1999, §3.1]
//
// All are conservative: a pixel that shows the region sees it along a direction of its view cone, lies in its
// screen rectangle, and no pixel shows a region that isBackFacing().
#pragma once

#include "render/gl/rect.h"
#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/cone.h"
#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <optional>

namespace surflect::slf {

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
  std::array<Vec3<double>, kPrismCorners> directions; // from the corners of the prism; unit, finite
  Cone cone; // around them; all directions where the viewer is inside
};
RegionView viewOf(const RegionBound& bound, const Vec3<double>& viewer);

// Returns whether the viewer is so far behind all triangles of the region that none of them can be drawn: the
// blackout cone then holds the view cone.
bool isBackFacing(const RegionBound& bound, const RegionView& view);

// Pixels that can show the region, within the picture; empty if there are none. For pinholes.
std::optional<gl::Rect> screenRect(const RegionBound& bound, const capture::Camera<AcquisitionSpace>& camera);

} // namespace surflect::slf
