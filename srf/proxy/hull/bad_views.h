// Detection of mattes that cut away what other views show.
#pragma once

#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/time.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::hull {

// The hull of all good mattes covers the silhouette of each good matte, because the object is inside. Where
// it does not, some view carves wrongly along the whole ray. On each such ray the points with the fewest
// votes against them (up to the allowed dissent) are found, and the views that vote against them blamed. A
// view that at least two others blame for half a percent of their silhouette is bad. The most blamed view is
// removed, and the test repeated, until no view is bad or a quarter of the views is removed. Works on a grid
// of 64 cells across the box, in which every step errs towards consent: consistent mattes are never found
// bad. A matte that is too large does no harm and stays.
//
// `box` contains all points possible under dissent (boundsOf). Returns indices in rising order.
std::vector<size_t> badViews(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                             const Eigen::AlignedBox3d& box, const Progress& progress);

} // namespace surflect::hull
