// Lamps by their reflections on a mirror ball.
//
// In each view, the outline of the ball gives its place, and the centre of a lamp's highlight the direction
// towards the lamp by the law of reflection, l = 2 (n . v) n - v. Rays of several views, or of several balls,
// meet at a lamp that is near; otherwise their mean direction is left. Near the rim, where the cosine c
// between view and normal is small, a pixel turns the normal by 1 / c as much: rays have the weight c^2.
#pragma once

#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/math/space.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::calibration {

struct Ball {
  Vec3<double> center; // in the axes that the function states
  double radius = 1;   // scene units
  double misfit = 0;   // root mean square distance from what it was fitted to, over the radius
};

// Ball in the camera's axes whose outline meets these pixel positions. A pinhole camera sees the rim of a
// sphere on a cone about its centre, r . a = cos(angle) for all unit rays r along the cone and the axis a, as
// a tangent from the eye makes one angle with the axis; the ball then has the given radius. An orthographic
// camera sees a circle, whose radius is found; the ball is at depth 0. Least squares, repeated without the
// positions more than three standard deviations off, as those of the ball's holder; `misfit` is of the rest.
// None for fewer than twelve positions, and where they fit no ball.
std::optional<Ball> ballOfOutline(const capture::Lens& lens, std::span<const capture::Pixel> outline,
                                  double radius = 1);

// Positions where a picture of 1 channel crosses 1/2 between neighbouring pixels, but those at its border.
std::vector<capture::Pixel> outlineOf(const image::Image& coverage);

// Centre of the highlight: of the connected pixels about the brightest one that exceed half of it, within the
// coverage. None if they fill more than a tenth of the coverage, as diffuse light does, or nothing is bright.
std::optional<capture::Pixel> highlightOf(const image::Image& luminance, const image::Image& coverage);

// Ray from the ball's surface towards what a pixel position shows in it, in the axes of the ball: the
// camera's. None beside the ball.
struct MirrorRay {
  Vec3<double> from, towards; // unit direction
  double cosine = 1;          // between view and normal
};
std::optional<MirrorRay> mirrorRay(const capture::Lens& lens, const Ball& ball, capture::Pixel pixel);

// Ball that all views see, in the world: the point nearest to the axes through its images of radius 1, and
// the mean radius; `misfit` is the distance of the axes. At least two pinhole views. None if the axes are
// parallel.
std::optional<Ball> ballOfViews(std::span<const capture::Camera<AcquisitionSpace>> cameras,
                                std::span<const Ball> ofUnitRadius);

// Lamp at the place nearest to all rays in angle, if it may be near and two rays or more tell its distance;
// otherwise in their mean direction.
struct LampOfRays {
  Vec3<double> place;         // meaningless unless isNear
  Vec3<double> towards;       // unit mean direction
  bool isNear = false;        // the place is known to a quarter of its distance
  double errorOfDistance = 0; // standard error over the distance
  double spread = 0;          // root mean square angle between the rays and the lamp, radians
};
LampOfRays lampOfRays(std::span<const MirrorRay> rays, bool mayBeNear = true);

} // namespace surflect::calibration
