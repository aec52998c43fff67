// Lamps by their reflections on a mirror ball.
//
// In each view, the outline of the ball gives its place, and the centre of a lamp's highlight the direction
// towards the lamp by the law of reflection, l = 2 (n . v) n - v. Rays of several views, or of several balls,
// meet at a lamp that is near; otherwise their mean direction is left.
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
};

// Ball in the camera's axes whose outline meets these pixel positions. Of a pinhole camera [a sphere's rim
// lies on a cone about its centre: r . a = cos(angle) for all unit rays r], of the given radius; of an
// orthographic one at depth 0, whose radius is found. None for fewer than twelve positions, and where they
// fit no ball.
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
  double cosine = 1;          // between view and normal; the direction is as much less exact near the rim
};
std::optional<MirrorRay> mirrorRay(const capture::Lens& lens, const Ball& ball, capture::Pixel pixel);

// Ball that all views see, in the world: the point nearest to the axes through its images of radius 1, and
// the mean radius. At least two pinhole views. None if the axes are parallel.
std::optional<Ball> ballOfViews(std::span<const capture::Camera<AcquisitionSpace>> cameras,
                                std::span<const Ball> ofUnitRadius);

// Lamp at the place nearest to all rays, which must be two or more, not parallel.
struct LampOfRays {
  Vec3<double> place;         // meaningless unless isNear
  Vec3<double> towards;       // unit mean direction
  bool isNear = false;        // the place is known to a quarter of its distance
  double errorOfDistance = 0; // standard error over the distance
  double spread = 0;          // root mean square angle between the rays and the lamp, radians
};
LampOfRays lampOfRays(std::span<const MirrorRay> rays);

} // namespace surflect::calibration
