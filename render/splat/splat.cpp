#include "render/splat/splat.h"

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

// Tolerance of the order for a surface that bends away from the splat's plane: kMaxSurfaceDeviation s along
// the normal, which is kMaxSurfaceDeviation s / cosine in depth, but at most s if the plane is seen edge-on.
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

// Eigenvalues of a symmetric matrix, b12 = b21: half the trace +- the radius of Mohr's circle.
struct Eigenvalues {
  double larger, smaller;
};
Eigenvalues eigenvalues(const Mat2& b) {
  const double half = b.trace() / 2, radius = std::hypot((b(0, 0) - b(1, 1)) / 2, b(0, 1));
  const double larger = half + radius;
  return {larger, larger > 0 ? std::max(0.0, b.determinant()) / larger : 0};
}

// Low-pass term D added to a covariance V: along each axis of the ellipse, the amount by which V falls short
// of h^2, so that wide splats are unchanged  [Botsch 2005, §5]. Convolution with the low-pass [Zwicker 2001]
// would add h^2 to those as well, and blur them a second time.
Mat2 lowPassDeficit(const Mat2& V, double h) {
  const auto [larger, smaller] = eigenvalues(V);
  const double most = std::max(0.0, h * h - smaller), least = std::max(0.0, h * h - larger);
  if (!(larger > smaller)) return most * Mat2::Identity();
  // P = (V - smaller I) / (larger - smaller) projects onto the long axis.
  const Mat2 P = (V - smaller * Mat2::Identity()) / (larger - smaller);
  return most * Mat2::Identity() + (least - most) * P;
}

// Widens V by D = lacking(V, h), keeping the energy coverage * 2 pi sqrt(det V) [Zwicker 2001, §5], and
// conditions the order on the pixel. With C the covariance of (x, y) with the order,
//   mean of order = order0 + slope . dx,   slope = (V + D)^-1 C.
// A splat larger than the filter gives the order of its plane, of gradient g = V^-1 C; a smaller splat that
// of its centre, however steep. Splats of one plane, displaced by dx = N(0, V + D) from a pixel, thus differ
// in order by
//   (g - slope) . dx = g^T D (V + D)^-1 dx,   of variance (D g)^T (V + D)^-1 (D g),
// which the tolerance must bridge. Edge-on, g is unbounded; it is damped as if the splat, grown to the size
// of the filter if smaller (k times its area), were h/2 thick.
Footprint filtered(const capture::Lens& lens, const ScreenGaussian& gaussian, double h, double coverage,
                   double bend) {
  const Mat2 V = gaussian.covariance.topLeftCorner<2, 2>();
  const Mat2 D = lowPassDeficit(V, h), filteredV = V + D;
  const Mat2 inverse = filteredV.inverse();
  const Vec2<double> C = gaussian.covariance.topRightCorner<2, 1>();
  const Vec2<double> slope = inverse * C;
  const double energyKept = std::sqrt(std::max(0.0, V.determinant()) / filteredV.determinant());

  const double k = 1 + h * h / eigenvalues(V).larger;
  const Vec2<double> gradient = (V + h * h / (4 * k) * Mat2::Identity()).inverse() * C;
  const Vec2<double> Dg = D * gradient;
  const double deviation = std::sqrt(Dg.dot(inverse * Dg));
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
