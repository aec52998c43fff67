#include "render/splat/splat.h"

#include "render/splat/low_pass.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::splat {

namespace {

using Mat2 = Eigen::Matrix2d;
using Mat32 = Eigen::Matrix<double, 3, 2>;

bool isPinhole(const capture::Lens& lens) { return lens.model == capture::Lens::Model::pinhole; }

// Image of a plane as a projective map of its parameters ab = (a, b):
//   (x, y, order) = origin + axes ab / (1 + w . ab),
// with x and y on the normalised image plane, y down (orthographic lens: scene units).
struct PlaneImage {
  Vec3<double> origin;
  Mat32 axes;
  Vec2<double> w;
};

PlaneImage imageOfPlane(const capture::Lens& lens, const Vec3<double>& p, const Vec3<double>& u,
                        const Vec3<double>& v) {
  Mat32 tangents;
  tangents << u, v;
  PlaneImage image;
  if (!isPinhole(lens)) {
    const Vec3<double> flip(1, -1, -1);
    image.origin = flip.cwiseProduct(p);
    image.axes = flip.asDiagonal() * tangents;
    image.w = Vec2<double>::Zero();
    return image;
  }
  const double depth = -p[2];
  image.origin = Vec3<double>(p[0], -p[1], -1) / depth;
  image.w = -tangents.row(2).transpose() / depth;
  image.axes.row(0) = tangents.row(0) / depth - image.origin[0] * image.w.transpose();
  image.axes.row(1) = -tangents.row(1) / depth - image.origin[1] * image.w.transpose();
  image.axes.row(2) = image.w.transpose() / depth;
  return image;
}

// Centre and covariance of the ellipse onto which a circle of radius s is projected: the dual conic M
// diag(s^2, s^2, -1) M^T of the homography M, solved relative to the image of p, which avoids cancellation.
//   mean       = -s^2 A w / D,                      D = 1 - s^2 |w|^2
//   covariance =  s^2 A A^T / D + mean mean^T       [Zwicker 2004, §4]
ScreenGaussian gaussianOfCircle(const PlaneImage& image, double s) {
  const double s2 = s * s;
  const double D = 1 - s2 * image.w.squaredNorm();
  const Vec3<double> shift = -s2 / D * (image.axes * image.w);
  return {image.origin + shift, s2 / D * (image.axes * image.axes.transpose()) + shift * shift.transpose()};
}

// Maps from the normalised image plane to pixels.
ScreenGaussian throughLens(const capture::Lens& lens, const ScreenGaussian& gaussian) {
  const Vec2<double> q = gaussian.mean.head<2>();
  const Vec2<double> focal(lens.focalX, lens.focalY);
  const Vec2<double> distorted = isPinhole(lens) ? capture::distort(lens, q) : q;
  Mat3<double> jacobian = Mat3<double>::Identity();
  jacobian.topLeftCorner<2, 2>() = focal.asDiagonal();
  if (isPinhole(lens)) jacobian.topLeftCorner<2, 2>() *= capture::distortionJacobian(lens, q);
  return {{lens.centerX + focal[0] * distorted[0], lens.centerY + focal[1] * distorted[1], gaussian.mean[2]},
          jacobian * gaussian.covariance * jacobian.transpose()};
}

// Tolerance of the order for a surface that bends away from the splat's plane by kMaxSurfaceDeviation s along
// the normal, hence by kMaxSurfaceDeviation s / cosine in depth. At most s, for planes seen nearly edge-on.
double bendTolerance(const capture::Lens& lens, const Vec3<double>& p, const Vec3<double>& crossUV,
                     double s) {
  const double area = crossUV.norm();
  const double cosine = std::abs(isPinhole(lens) ? crossUV.dot(p) / p[2] : crossUV[2]) / area;
  const double deepest = s * std::sqrt(area);
  const double depthTolerance = deepest * std::min(kMaxSurfaceDeviation / cosine, 1.0);
  return isPinhole(lens) ? depthTolerance / (p[2] * p[2]) : depthTolerance; // d order / d depth = 1/depth^2
}

PixelBox clippedBox(const capture::Lens& lens, const Vec3<double>& mean, const Mat2& filteredV) {
  const auto first = [](double low, int size) {
    return static_cast<int>(std::clamp(std::ceil(low - 0.5), 0.0, double(size)));
  };
  const double halfX = kCutoffSigmas * std::sqrt(filteredV(0, 0));
  const double halfY = kCutoffSigmas * std::sqrt(filteredV(1, 1));
  return {first(mean[0] - halfX, lens.width), first(mean[1] - halfY, lens.height),
          first(mean[0] + halfX, lens.width), first(mean[1] + halfY, lens.height)};
}

// Footprint of a Gaussian after the low-pass. The tolerance bridges the orders of splats of one plane.
Footprint filtered(const capture::Lens& lens, const ScreenGaussian& gaussian, double h, double coverage,
                   double bend) {
  const auto [filteredV, inverse, energyKept, slope, deviation] =
      lowPassed(gaussian.covariance.topLeftCorner<2, 2>(), gaussian.covariance.topRightCorner<2, 1>(), h);
  const double tolerance = kDepthSigmas * deviation + bend;

  Footprint f{};
  f.x = static_cast<float>(gaussian.mean[0]);
  f.y = static_cast<float>(gaussian.mean[1]);
  f.xx = static_cast<float>(inverse(0, 0));
  f.skew = static_cast<float>(-filteredV(0, 1) / filteredV(1, 1));
  f.yy = static_cast<float>(1 / filteredV(1, 1));
  f.peak = static_cast<float>(coverage * energyKept);
  f.order = static_cast<float>(gaussian.mean[2]);
  f.orderX = static_cast<float>(slope[0]);
  f.orderY = static_cast<float>(slope[1]);
  f.tolerance = static_cast<float>(tolerance);
  f.box = clippedBox(lens, gaussian.mean, filteredV);
  return f;
}

bool finite(const Footprint& f) {
  const float sum = f.x + f.y + f.xx + f.skew + f.yy + f.peak + f.order + f.orderX + f.orderY + f.tolerance;
  return std::isfinite(sum) && f.xx > 0 && f.yy > 0;
}

} // namespace

Splats splatsOf(const SurfelCloud& rest, const DeformedCloud& deformed) {
  assert(rest.size() == deformed.size());
  return {deformed.p, deformed.u, deformed.v, deformed.handedness, rest.radius, rest.coverage};
}

ScreenGaussian project(const capture::Lens& lens, const Point3<CameraSpace, double>& p,
                       const Direction3<CameraSpace, double>& u, const Direction3<CameraSpace, double>& v,
                       double s) {
  return throughLens(lens, gaussianOfCircle(imageOfPlane(lens, p.raw(), u.raw(), v.raw()), s));
}

std::variant<Footprint, Rejection> footprintOf(const capture::Camera<ObjectSpace>& camera,
                                               const Splats& splats, size_t index,
                                               const SplatOptions& options) {
  if (splats.handedness[index] == Handedness::dead) return Rejection::dead;

  const capture::Lens& lens = camera.lens;
  const Mat3<double>& rotation = camera.cameraFromWorld.rotation();
  const Vec3<double> p = camera.cameraFromWorld(splats.p[index].cast<double>()).raw();
  const Vec3<double> u = rotation * splats.u[index].raw().cast<double>();
  const Vec3<double> v = rotation * splats.v[index].raw().cast<double>();
  const Vec3<double> crossUV = u.cross(v);
  const double s = kSigmaPerRadius * splats.radius[index], coverage = splats.coverage[index];
  if (!std::isfinite(p.sum() + crossUV.sum()) || !(crossUV.squaredNorm() > 0) || //
      !(s > 0) || !std::isfinite(s) || !(coverage > 0) || !std::isfinite(coverage))
    return Rejection::notFinite;

  const double outward = splats.handedness[index] == Handedness::mirrored ? -1 : 1;
  const Vec3<double> towardsViewer = isPinhole(lens) ? Vec3<double>(-p) : Vec3<double>(0, 0, 1);
  const bool facesViewer = outward * crossUV.dot(towardsViewer) > 0;
  if (isPinhole(lens)) {
    const double depth = -p[2];
    const double nearest = depth - kCutoffSigmas * s * std::hypot(u[2], v[2]);
    if (!(nearest > std::max(options.nearDepth, kNearestDepthFraction * depth))) return Rejection::tooNear;
  }
  if (!facesViewer) return Rejection::backFacing;

  const ScreenGaussian gaussian = throughLens(lens, gaussianOfCircle(imageOfPlane(lens, p, u, v), s));
  const Footprint footprint =
      filtered(lens, gaussian, options.lowPass, coverage, bendTolerance(lens, p, crossUV, s));
  if (!finite(footprint)) return Rejection::notFinite;
  const bool seenByLens = project(lens, assume<Point3<CameraSpace, double>>(p)).has_value();
  if (footprint.box.empty() || !seenByLens) return Rejection::outside;
  return footprint;
}

} // namespace surflect::splat
