// Low-pass of EWA splatting: no splat is narrower on the screen than about a pixel.
//
// [Zwicker 2001] Zwicker, Pfister, van Baar, Gross: EWA Volume Splatting, §5.
// [Botsch 2005]  Botsch, Hornung, Zwicker, Kobbelt: High-Quality Surface Splatting on Today's GPUs, §5.
// Symbols: V covariance of a splat in pixels; h least standard deviation, SplatOptions::lowPass; D what is
// added to V; C covariance of the pixel with the order.
//
// This is the plain form in double precision. project_kernel.cpp has the same in single precision, for
// vectors.
#pragma once

#include "surfel/math/space.h"

#include <Eigen/Core>

namespace surflect::splat {

// D: along each axis of the ellipse, the amount by which V falls short of h^2, so that wide splats are
// unchanged  [Botsch 2005, §5]. Convolution with the low-pass [Zwicker 2001] would add h^2 to wide splats as
// well, and blur them a second time.
Eigen::Matrix2d lowPassDeficit(const Eigen::Matrix2d& V, double h);

struct LowPassed {
  Eigen::Matrix2d covariance; // V + D
  Eigen::Matrix2d inverse;    // (V + D)^-1
  double energyKept;     // factor of the peak, so that peak * 2 pi sqrt(det V) is kept  [Zwicker 2001, §5]
  Vec2<double> slope;    // mean of order = order of the centre + slope . dx,   slope = (V + D)^-1 C
  double orderDeviation; // standard deviation of the order between splats of one plane, at a pixel
};

// Widens V by D, and conditions the order on the pixel. A splat larger than the filter has the order of its
// plane, of gradient g = V^-1 C; a smaller splat has the order of its centre everywhere, however steep its
// plane is. Splats of one plane, displaced by dx = N(0, V + D) from a pixel, thus differ in order by
//   (g - slope) . dx = g^T D (V + D)^-1 dx,   of variance (D g)^T (V + D)^-1 (D g).
// If the plane is seen edge-on, g is unbounded; g is therefore damped as if the splat were h/2 thick. For
// this, a splat smaller than the filter counts as grown to the filter's size, which is k times its area.
LowPassed lowPassed(const Eigen::Matrix2d& V, const Vec2<double>& C, double h);

} // namespace surflect::splat
