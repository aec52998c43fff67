// The silhouettes of a capture.
#pragma once

#include "srf/capture/capture.h"
#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/progress.h"

#include <vector>

namespace surflect::hull {

// Of each view that has a matte, the union of all its frames' mattes, each read once. A matte without
// background says nothing and counts as none. Throws Error for what
// cannot be read.
std::vector<SilhouetteView> silhouetteViewsOf(const capture::Capture& capture, const Progress& progress);

} // namespace surflect::hull
