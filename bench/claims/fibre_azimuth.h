// "This approximation may introduce a slight rotation of the principal axis of an anisotropic BRDF when the
// surface is sheared." [Weyrich 2005, §4.2]
//
// A plate with straight fibres in its plane under the shear x' = x + s y. Fibres follow the surface: a fibre
// t becomes J t. The look-up shows the captured fibre turned as L turns it. By how much:
//   polar factor of (u, v)        atan(s / 2), whatever u0
//   Eq. 8, u0 or v0 along x       atan(s) / 2
// clockwise, as seen from outside. Fibres along x stay where they are, fibres along y turn by atan(s).
#pragma once

#include "render/surfels/frame.h"
#include "surfel/math/angle.h"

#include <filesystem>
#include <functional>

namespace surflect::bench {

using FrameOf =
    std::function<std::optional<OrthonormalFrame<double>>(const Vec3<double>& u, const Vec3<double>& v)>;

// By what angle, counter-clockwise, L turns what was captured, for tangents u0 = (cos phi, sin phi), v0 at
// right angles to it.
Angle turnUnderShear(const FrameOf& frameOf, double shear, Angle phi);

// Where the fibre is after the shear, counter-clockwise from x.
Angle fibreUnderShear(double shear, Angle fibre);

// Photographs of a brushed plate from above, under lights from all over the upper hemisphere's middle.
class BrushedPlate {
public:
  BrushedPlate(Angle fibre, const std::filesystem::path& work);

  // A point light over the middle of the sheared plate, seen from above: path traced, its fibres being J t;
  // and answered by the photographs. One channel, a square of side 1.4.
  image::Image truth(double shear) const;
  image::Image rendered(const FrameOf& frameOf, double shear) const;

private:
  Angle fibre_;
  model::Model model_;
};

// The fibre's azimuth, 0 to 180 degrees, as told by the highlight of such a picture: the streak that a lamp
// over the middle draws lies across the fibres. By second moments within the disc that fits into the square;
// they are exact, since light and view are the same from all sides.
Angle azimuthOf(const image::Image& picture);

} // namespace surflect::bench
