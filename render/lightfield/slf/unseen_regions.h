// Radiance for regions that no photograph sees, from the regions around them.
#pragma once

#include "render/lightfield/slf/chart.h"
#include "surfel/math/space.h"

#include <span>
#include <vector>

namespace surflect::slf {

// Mean radiance of each texture of a region, by direction; empty for a region that no photograph sees.
using MeanRadiance = std::vector<Vec3<float>>;

// Gives each region without means the mean of its neighbours' means, weighted by the number of shared
// vertices, step by step outwards. Regions that are not connected to a seen region stay without means. All
// means are by the directions of one direction mesh.
void fillUnseenRegions(std::span<const Chart> charts, std::vector<MeanRadiance>& means);

} // namespace surflect::slf
