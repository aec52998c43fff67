// Least stretch of a disc within a rectangle: all vertices move freely, also those of the border.
//
// [Sander 2001] Sander, Snyder, Gortler, Hoppe: Texture Mapping Progressive Meshes, §3.2.
#pragma once

#include "render/lightfield/slf/disc.h"
#include "surfel/base/progress.h"
#include "surfel/math/space.h"

#include <vector>

namespace surflect::slf {

struct DescentOptions {
  int mostSweeps = 300;
  double leastGain = 3e-4; // stops once a sweep lowers the stretch by a smaller share
  double clearance = 0;    // of parts of the border (border_gaps.h), in sides of a square of the same area
};

// Moves vertices of a one-to-one map over the unit square so that the integral over the surface of
// a / s^2 + c s^2 falls, where s is the best aspect: the squared stretch for a given number of texels.
// Vertices move one after another, by steps of Newton that leave all triangles positive and the border
// without crossings, so that the map stays one to one [Sander 2001, §3.2]. [Sander 2001] searches along
// random directions; here derivatives give the steps. Throws Cancelled.
void lowerStretch(const Disc& disc, std::vector<Vec2<double>>& coordinates,
                  const DescentOptions& options = {}, const Progress& progress = {});

} // namespace surflect::slf
