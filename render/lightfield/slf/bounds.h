// Bounds of a texture region, by which rendering passes are culled. [Azuma 1999, §3.1]
//
// All are conservative: a pixel that shows the region sees it along a direction of its view cone, lies in its
// screen rectangle, and no pixel shows a region that isBackFacing().
#pragma once

#include "render/gl/rect.h"
#include "render/lightfield/slf/chart.h"
#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace surflect::slf {

// Directions within `angle` (radians) of a unit axis; from pi on, all directions.
struct Cone {
  Vec3<double> axis = {0, 0, 1};
  double angle = 0;
};

// Cone around directions that need not be unit; all directions if one of them is zero or not finite.
// Nearly the narrowest.
Cone coneAround(std::span<const Vec3<double>> directions);

inline constexpr size_t kPrismCorners = 16;

// Rasterisers round corners to 1/256 pixel. Small triangles at the silhouette that face away by at most this
// angle, in radians, may therefore turn over and be drawn.
inline constexpr double kTurnOver = 0.02;

struct RegionBound {
  std::array<Vec3<double>, kPrismCorners>
      corners;  // of an octagonal prism around the region; acquisition space
  Cone normals; // of the region's triangles; those without area are left out
};

// The chart must have triangles.
RegionBound boundOf(const TriangleMesh& mesh, const Chart& chart);

// Directions from a region to the viewer. Rays of pixels differ from it by rounding alone.
struct RegionView {
  std::array<Vec3<double>, kPrismCorners> directions; // from the corners of the prism; unit, finite
  Cone cone; // around them; all directions where the viewer is inside
};
RegionView viewOf(const RegionBound& bound, const Vec3<double>& viewer);

// Whether the viewer is so far behind all triangles of the region that none of them can be drawn. The
// region's blackout cone, turned to the viewer, then holds the region's view cone.
bool isBackFacing(const RegionBound& bound, const RegionView& view);

// Pixels that can show the region, within the picture; empty if there are none. For pinholes.
std::optional<gl::Rect> screenRect(const RegionBound& bound, const capture::Camera<AcquisitionSpace>& camera);

} // namespace surflect::slf
