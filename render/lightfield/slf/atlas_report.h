// Quality of an atlas: how flat its regions are, how its charts stretch, and what they cost in texels.
#pragma once

#include "render/lightfield/slf/chart.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <span>

namespace surflect::slf {

struct AtlasReport {
  size_t regions = 0;
  double worstCone = 0, meanCone = 0; // half-angle of a region's normals, in degrees; the mean is by area
  double smallestShare = 0, largestShare = 0; // region's area over the mean region's area
  // Stretch: distance on the surface for a unit length in texels, over that of a map that keeps all areas; 1
  // is best [Sander 2001, §3]. meanStretch: root mean square over the surface and all directions.
  // highStretch: largest stretch in any direction, exceeded on 1 % of the surface.
  double meanStretch = 0, highStretch = 0;
  size_t texels = 0;       // stored
  size_t texelsNeeded = 0; // in reach of bilinear look-ups on the surface
  double redundancy = 0;   // texels / texelsNeeded
  // texels / (area / texelSize^2): stored over those of a square grid on the surface.
  double cost = 0;
};

// Throws Cancelled.
AtlasReport atlasReport(const TriangleMesh& mesh, std::span<const Chart> charts, double texelSize,
                        const Progress& progress = {});

// Number of texels of a chart that bilinear look-ups within its triangles weigh by more than 0.
size_t texelsInReach(const Chart& chart);

} // namespace surflect::slf
