// Which mattes cut away what the others show.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/progress.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::hull {

// The silhouette of a good matte is covered by the hull of all good ones, since the object is in it. Where it
// is not, some view wrongly carves all along the ray: on each ray the points with the fewest votes against
// them (but no more than the allowed dissent) are looked up, and their opponents blamed. A view that at least
// two others blame for half a percent of their silhouette is bad. The one that is blamed most leaves; then
// anew, until none is bad or a quarter of the views is gone. Works on a grid of 64 cells across the box, in
// which every step errs on the side of consent: consistent mattes are never found bad. A matte that is too
// large does no harm and stays.
//
// `box` holds what is possible with dissent, see boundsOf. Returns indices in rising order.
std::vector<size_t> badViews(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                             const Eigen::AlignedBox3d& box, const Progress& progress);

} // namespace surflect::hull
