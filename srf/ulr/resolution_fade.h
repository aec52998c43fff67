// Fade of views that sample a surfel too coarsely, as seen from far away or through a short lens. ULR alone
// would blend a distant view with a near one whenever its direction is nearer.
//
//   d_i = f_x f_y / r^2,   d* = max_i s_i d_i,   fade_i = min(1, 2 d_i / d*)^2
//
// Symbols: d_i density of view i, in pixels on a unit of area that faces it, f_x, f_y focal lengths in
// pixels, r distance; s_i visibility weight without this fade; d* density of the best view. Buehler adds a
// penalty for resolution [Buehler 2001, §4]; as a factor of s_i, it costs no time when rendering, and under
// ULR a view that is met keeps its weight. Views of up to 1.4 times the distance of the best one do not fade.
//
// [Buehler 2001] Buehler, Bosse, McMillan, Gortler, Cohen: Unstructured Lumigraph Rendering, SIGGRAPH.
#pragma once

#include "srf/capture/camera.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace surflect::ulr {

// d_i at a point.
inline double samplingDensity(const capture::Camera<AcquisitionSpace>& camera,
                              const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                              const Point3<AcquisitionSpace, double>& point) {
  const double unit = viewpoint.isDistant() ? 1 : viewpoint.distance(point);
  return camera.lens.focalX * camera.lens.focalY / (unit * unit);
}

inline double resolutionFade(double density, double best) {
  if (!(best > 0)) return 1;
  const double share = std::min(1.0, 2 * density / best);
  return share * share;
}

// Multiplies the weights s_i of a surfel by its views' fades.
inline void fadeByResolution(std::span<double> weights, std::span<const double> densities) {
  double best = 0;
  for (size_t view = 0; view < weights.size(); ++view) best = std::max(best, weights[view] * densities[view]);
  for (size_t view = 0; view < weights.size(); ++view) weights[view] *= resolutionFade(densities[view], best);
}

} // namespace surflect::ulr
