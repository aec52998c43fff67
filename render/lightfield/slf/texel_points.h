// Surface points of the texels of a chart.
#pragma once

#include "render/lightfield/slf/chart.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <cstdint>
#include <vector>

namespace surflect::slf {

struct TexelPoint {
  static constexpr uint32_t kNone = UINT32_MAX;

  uint32_t meshTriangle = kNone; // kNone if the chart has no triangle with an area, on texture and surface
  Point3<AcquisitionSpace, double> position;
  bool isInside = false; // the texel's centre lies in the chart; otherwise the point is the chart's nearest
};

// One for each texel, rows of the chart's width, row 0 first. Where triangles overlap, the first one counts.
std::vector<TexelPoint> texelPoints(const TriangleMesh& mesh, const Chart& chart);

} // namespace surflect::slf
