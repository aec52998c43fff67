// Samples of a blurred frame: an instant while the shutter is open, and the point of the lens that looks.
//
// [Haeberli 1990] Haeberli, Akeley: The Accumulation Buffer: Hardware Support for High-Quality Rendering,
//                 SIGGRAPH '90: motion blur and depth of field as means of sharp pictures.
// [Hammersley 1960] Hammersley: Monte Carlo Methods for Solving Multivariable Problems.
// [Shirley 1997] Shirley, Chiu: A Low Distortion Map Between Disk and Square, JGT 2(3).
#pragma once

#include "srf/capture/camera.h"
#include "surfel/math/space.h"

#include <vector>

namespace surflect::film {

struct BlurSample {
  double time;       // -1/2..1/2 of the time that the shutter is open
  Vec2<double> lens; // on the unit disc: x right, y up
};

// Sample i of n > 0: times at the middles of n equal parts, and lens points that are well spread over the
// disc and over time. One sample alone is at the middle of both.
BlurSample blurSample(int i, int n);

// The square 0..1 x 0..1 on the unit disc: equal areas stay equal, and neighbours near.  [Shirley 1997]
Vec2<double> onDisc(const Vec2<double>& square);

// The pinhole camera at another point of a thin lens: moved by `offset` (scene units, x right, y up) within
// the plane of the lens. The pixels of points at the focus distance along the viewing axis stay, for the
// principal point moves by offset x focal length / distance. Throws Error for a lens that distorts, whose
// picture would not only move, for an orthographic one, and for an offset so large that pixels are lost.
capture::Camera<ObjectSpace> throughLensPoint(const capture::Camera<ObjectSpace>& camera,
                                              const Vec2<double>& offset, double focusDistance);

// Diameter in pixels of the disc that a point at `depth` becomes: aperture x focal length (pixels) x
// |depth - focusDistance| / (depth x focusDistance).
double circleOfConfusion(double aperture, double focal, double focusDistance, double depth);

} // namespace surflect::film
