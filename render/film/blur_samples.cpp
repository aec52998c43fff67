#include "render/film/blur_samples.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <cmath>
#include <numbers>

namespace surflect::film {

namespace {

// Digits of i in a base, mirrored at the point: 6 = 110 in base 2 becomes .011.  [Hammersley 1960]
double radicalInverse(int i, int base) {
  double inverse = 0, digit = 1;
  for (; i > 0; i /= base) inverse += (digit /= base) * (i % base);
  return inverse;
}

} // namespace

BlurSample blurSample(int i, int n) {
  const double half = 0.5 / n; // to the middle of a part: the radical inverse is its begin
  return {(i + 0.5) / n - 0.5, onDisc({radicalInverse(i, 2) + half, radicalInverse(i, 3) + half})};
}

Vec2<double> onDisc(const Vec2<double>& square) {
  const double a = 2 * square[0] - 1, b = 2 * square[1] - 1;
  if (a == 0 && b == 0) return {0, 0};
  constexpr double quarter = std::numbers::pi / 4;
  const bool isWide = std::abs(a) > std::abs(b);
  const double radius = isWide ? a : b;
  const double angle = isWide ? quarter * b / a : 2 * quarter - quarter * a / b;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

capture::Camera<ObjectSpace> throughLensPoint(const capture::Camera<ObjectSpace>& camera,
                                              const Vec2<double>& offset, double focusDistance) {
  if (camera.lens.model != capture::Lens::Model::pinhole)
    throw Error::mismatch("0 for an orthographic camera, in which all is sharp", "more").at("aperture");
  if (camera.lens.distorts())
    throw Error::mismatch("0 for a captured camera whose lens distorts", "more").at("aperture");
  constexpr double farthest = 1e6; // pixels of the principal point
  capture::Camera<ObjectSpace> moved = camera;
  moved.lens.centerX += camera.lens.focalX * offset[0] / focusDistance;
  moved.lens.centerY -= camera.lens.focalY * offset[1] / focusDistance;
  if (!(std::abs(moved.lens.centerX) < farthest && std::abs(moved.lens.centerY) < farthest))
    throw Error::mismatch("a smaller lens for a focus at " + numberText(focusDistance),
                          "a lens point " + numberText(offset.norm()) + " from the axis")
        .at("aperture");
  const Rigid<CameraSpace, ObjectSpace>& pose = camera.cameraFromWorld;
  moved.cameraFromWorld = {pose.rotation(),
                           Vec3<double>(pose.translation() - Vec3<double>(offset[0], offset[1], 0))};
  return moved;
}

double circleOfConfusion(double aperture, double focal, double focusDistance, double depth) {
  return aperture * focal * std::abs(depth - focusDistance) / (depth * focusDistance);
}

} // namespace surflect::film
