// Charts of all texture regions: each region parametrised over a rectangle of texels.
#pragma once

#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/regions.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <vector>

namespace surflect::slf {

inline constexpr int kShortestSide = 4, kLongestSide = 16384; // texels

// Charts of the regions in their order. Each is one to one, also after rounding to float, and stays within
// [0.5 / width, 1 - 0.5 / width] and the same of the height, so that bilinear look-ups stay within the
// texture. A region's area on the surface is about its texels times texelSize^2, texelSize being in the
// mesh's unit; sides have at least 4 texels. A region that cannot be mapped so is cut in two; then there are
// more charts than regions. Throws Error for a texel size that is not positive or needs sides over 16384
// texels; and Cancelled.
std::vector<Chart> chartsOf(const TriangleMesh& mesh, const Regions& regions, double texelSize,
                            const Progress& progress = {});

struct FittedCharts {
  std::vector<Chart> charts;
  double texelSize = 0;
};

// Charts with texels of this size, or as much larger as it takes to have no more than about 1.05 mostTexels
// in all. Regions are parametrised once. Throws as chartsOf() does.
FittedCharts fittedCharts(const TriangleMesh& mesh, const Regions& regions, double texelSize,
                          size_t mostTexels, const Progress& progress = {});

} // namespace surflect::slf
