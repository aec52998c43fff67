#include "srf/capture/camera.h"

#include <cmath>

namespace surflect::capture {

Vec2<double> distort(const Lens& lens, const Vec2<double>& undistorted) {
  const double x = undistorted[0], y = undistorted[1];
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  return {x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x),
          y * radial + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y};
}

Eigen::Matrix2d distortionJacobian(const Lens& lens, const Vec2<double>& q) {
  const double x = q[0], y = q[1], r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  const double slope = 2 * (lens.k1 + r2 * (2 * lens.k2 + 3 * r2 * lens.k3)); // d radial / d(r2) * 2
  Eigen::Matrix2d j;
  j << radial + slope * x * x + 2 * lens.p1 * y + 6 * lens.p2 * x,
      slope * x * y + 2 * lens.p1 * x + 2 * lens.p2 * y, slope * x * y + 2 * lens.p1 * x + 2 * lens.p2 * y,
      radial + slope * y * y + 6 * lens.p1 * y + 2 * lens.p2 * x;
  return j;
}

namespace {

// Returns whether a radius is before the distortion's fold: a radial polynomial with negative terms turns
// back at some radius, and points beyond would appear in the picture a second time. True up to the first zero
// of d/dr (r + k1 r^3 + k2 r^5 + k3 r^7) = 1 + 3 k1 r^2 + 5 k2 r^4 + 7 k3 r^6, a polynomial in r^2 that is
// positive up to a radius if it is so there and at its extrema before.
bool beforeTheFold(const Lens& lens, double r2) {
  const double a = 7 * lens.k3, b = 5 * lens.k2, c = 3 * lens.k1;
  const auto isRising = [&](double s) { return 1 + s * (c + s * (b + s * a)) > 0; };
  const auto isRisingBefore = [&](double s) { return !(s > 0 && s < r2) || isRising(s); };
  if (!isRising(r2)) return false;
  if (a == 0) return isRisingBefore(-c / (2 * b)); // infinite or not a number without k2: no extremum
  const double discriminant = b * b - 3 * a * c;   // of 3 a s^2 + 2 b s + c
  if (!(discriminant > 0)) return true;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b)); // the root without cancellation
  return isRisingBefore(q / (3 * a)) && isRisingBefore(c / q);
}

} // namespace

std::optional<Vec2<double>> undistort(const Lens& lens, const Vec2<double>& distorted) {
  if (!lens.distorts()) return distorted;
  Vec2<double> q = distorted;
  for (int step = 0; step < 30; ++step) {
    const Eigen::Matrix2d j = distortionJacobian(lens, q);
    if (!(j.determinant() > 0)) return std::nullopt; // beyond the fold
    const Vec2<double> residual = distort(lens, q) - distorted;
    q -= j.inverse() * residual;
    if (residual.norm() < 1e-8) // this step has squared it
      return beforeTheFold(lens, q.squaredNorm()) ? std::optional(q) : std::nullopt;
  }
  return std::nullopt;
}

std::optional<Pixel> project(const Lens& lens, const Point3<CameraSpace, double>& p) {
  if (lens.model == Lens::Model::orthographic)
    return Pixel{lens.centerX + lens.focalX * p.x(), lens.centerY - lens.focalY * p.y()};
  const double depth = -p.z();
  if (!(depth > 0)) return std::nullopt;
  const Vec2<double> straight(p.x() / depth, -p.y() / depth);
  if (!lens.distorts())
    return Pixel{lens.centerX + lens.focalX * straight[0], lens.centerY + lens.focalY * straight[1]};
  if (!beforeTheFold(lens, straight.squaredNorm())) return std::nullopt;
  const Vec2<double> q = distort(lens, straight);
  return Pixel{lens.centerX + lens.focalX * q[0], lens.centerY + lens.focalY * q[1]};
}

std::optional<CameraRay> rayThrough(const Lens& lens, Pixel pixel) {
  const double x = (pixel.x - lens.centerX) / lens.focalX, y = (pixel.y - lens.centerY) / lens.focalY;
  if (lens.model == Lens::Model::orthographic) return CameraRay{{x, -y, 0}, {0, 0, -1}};
  const auto q = undistort(lens, {x, y});
  if (!q) return std::nullopt;
  return CameraRay{{0, 0, 0}, normalized(Direction3<CameraSpace, double>((*q)[0], -(*q)[1], -1))};
}

Lens resized(Lens lens, int width, int height) {
  const double x = static_cast<double>(width) / lens.width, y = static_cast<double>(height) / lens.height;
  lens.focalX *= x, lens.centerX *= x, lens.width = width;
  lens.focalY *= y, lens.centerY *= y, lens.height = height;
  return lens;
}

} // namespace surflect::capture
