// Silhouettes of a capture.
#pragma once

#include "srf/capture/capture.h"
#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/progress.h"

#include <vector>

namespace surflect::hull {

// One silhouette per view with a matte: the union of the mattes of its frames, each read once. A matte
// without background counts as none. Throws Error for unreadable files.
std::vector<SilhouetteView> silhouetteViewsOf(const capture::Capture& capture, const Progress& progress);

} // namespace surflect::hull
