// Silhouettes of a capture.
#pragma once

#include "srf/capture/capture.h"
#include "srf/proxy/hull/silhouette_view.h"
#include "surfel/base/time.h"

#include <vector>

namespace surflect::hull {

// Pixels of a silhouette: those with alpha above 1/2, whose outline is found between pixels; or, for an
// opacity hull, those with alpha above 0, and their neighbours.
enum class Silhouette { half, touched };

// One silhouette per view with a matte: that of the mattes of its frames (matte_vote.h), each read once. A
// matte without background counts as none. Throws Error for unreadable files.
std::vector<SilhouetteView> silhouetteViewsOf(const capture::Capture& capture, const Progress& progress,
                                              Silhouette silhouette = Silhouette::half);

} // namespace surflect::hull
