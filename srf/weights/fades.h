// Fades: factors of 0..1 by which photographs leave a blend without a jump, along camera paths and along the
// surface.
//
// Resolution: a view that samples a surfel coarsely, from far away or through a short lens, fades beside a
// finer one. ULR alone would blend a distant view with a near one whenever its direction is nearer.
//
//   d_i = f_x f_y / r^2,   d* = max_i s_i d_i,   fade_i = min(1, 2 d_i / d*)^2
//
// Symbols: d_i density of view i, in pixels on a unit of area that faces it, f_x, f_y focal lengths in
// pixels, r distance; s_i visibility weight without this fade; d* density of the best view. Buehler adds a
// penalty for resolution [Buehler 2001, §4]. Here resolution is a factor of s_i instead, which costs no time
// when rendering; under ULR, a viewer in the direction of a captured view still gets that view alone. Views
// of up to 1.4 times the distance of the best one do not fade.
//
// Extrapolation: ULR uses the nearest captured lights at any distance [Weyrich 2005, §5.2]. If the rig covers
// only a cone or a dome, all light of an environment from outside of it is given to the lights on the rim;
// that light can be faded out instead.
//
// [Buehler 2001] Buehler, Bosse, McMillan, Gortler, Cohen: Unstructured Lumigraph Rendering, SIGGRAPH.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/math/space.h"

#include <span>

namespace surflect::weights {

// Smooth step: 0 for x <= from, 1 for x >= to, continuously differentiable.
double smoothStep(double from, double to, double x);

// Fade of a view at grazing angles, by the cosine between the normal and the direction to the camera: 0 for
// cosines below 0, 1 above 0.3.
inline double grazingFade(double cosine) { return smoothStep(0.0, 0.3, cosine); }

// Fade of light at the terminator, where coarse occluders cannot tell a surfel that faces the light from one
// that does not: 0 for cosines of light and normal below 0, 1 above 0.1.
inline double terminatorFade(double cosine) { return smoothStep(0, 0.1, cosine); }

// Fade over the last pixels before the border of the image; 0 outside.
double borderFade(const capture::Lens& lens, capture::Pixel pixel);

// d_i at a point.
double samplingDensity(const capture::Camera<AcquisitionSpace>& camera,
                       const capture::Viewpoint<AcquisitionSpace>& viewpoint,
                       const Point3<AcquisitionSpace, double>& point);

// Fade of a view by its density and d*.
double resolutionFade(double density, double best);

// Multiplies the weights s_i of a surfel by its views' resolution fades.
void fadeByResolution(std::span<double> weights, std::span<const double> densities);

// Light from directions without captured lights: that of the nearest ones at any distance, or faded out.
enum class LightExtrapolation { clamp, fade };

// Spacing of a rig's lights, and the fade of light beyond them.
class LightExtrapolationFade {
public:
  // `lights` are unit directions from the middle of the object to the captured lights. The spacing is the
  // largest distance from a light to its nearest neighbour, so that nothing fades between the rig's lights.
  explicit LightExtrapolationFade(std::span<const Direction3<AcquisitionSpace, double>> lights);

  // Radians; pi if there are fewer than two distinct directions, in which case nothing fades.
  double spacing() const { return spacing_; }

  // Fade factor: 1 up to one spacing from the nearest captured light, 0 beyond two spacings, continuously
  // differentiable. `penalty` is 1 - cos of the angle to that light.
  float at(float penalty) const;

private:
  double spacing_, from_, to_; // from_, to_: penalties
};

} // namespace surflect::weights
