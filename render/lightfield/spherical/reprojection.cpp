#include "render/lightfield/spherical/reprojection.h"

#include <algorithm>
#include <cmath>

namespace surflect::spherical {

Vec2<double> atPlane(const Vec3<double>& e, const Vec3<double>& w) {
  return e.head<2>() - e[2] / w[2] * w.head<2>();
}

Vec2<double> slopeOf(const Vec3<double>& w) { return w.head<2>() / w[2]; }

bool passesSphere(const Vec3<double>& e, const Vec2<double>& atPlane, const Vec2<double>& slope) {
  const Vec2<double> offset = atPlane - Vec2<double>(0.5, 0.5);
  // Height at which the line is nearest to the middle of the sphere.
  const double nearest = -offset.dot(slope) / (1 + slope.squaredNorm());
  const bool isInside = (e - Vec3<double>(0.5, 0.5, 0)).squaredNorm() < 0.25;
  return (nearest < e[2] || isInside) && (offset + nearest * slope).squaredNorm() + nearest * nearest < 0.25;
}

double visibility(const PencilImage& image, const Vec3<double>& place, double mip) {
  const double texel = std::exp2(mip) / image.mips[0].size;
  const double inFront = heightAt(image, place.head<2>(), mip) - place[2];
  return std::clamp(2 - inFront / (kTolerance * texel), 0.0, 1.0);
}

double weightOfAlpha(double alpha) {
  const double solid = std::clamp(2 * alpha - 1, 0.0, 1.0);
  return solid * solid;
}

double mipFor(const Sphere& sphere, int size, double distance, double pixel) {
  const double texel = 2 * sphere.radius / size;
  return std::max(0.0, std::log2(distance * pixel / texel));
}

} // namespace surflect::spherical
