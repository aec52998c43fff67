#include "srf/proxy/hull/silhouette_view.h"

#include "surfel/base/error.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::hull {

namespace {

double meanFocal(const capture::Lens& lens) { return std::sqrt(lens.focalX * lens.focalY); }

double footprintAt(const capture::Lens& lens, const Point3<CameraSpace, double>& p) {
  return (lens.model == capture::Lens::Model::orthographic ? 1 : -p.z()) / meanFocal(lens);
}

// Distance of a pixel to the nearest side of the image; negative outside.
double borderDistance(const capture::Lens& lens, capture::Pixel pixel) {
  return std::min({pixel.x, pixel.y, lens.width - pixel.x, lens.height - pixel.y});
}

} // namespace

double pixelFootprint(const capture::Camera<AcquisitionSpace>& camera,
                      const Point3<AcquisitionSpace, double>& p) {
  return footprintAt(camera.lens, camera.cameraFromWorld(p));
}

std::optional<double> coneDistance(const SilhouetteView& silhouetteView,
                                   const Point3<AcquisitionSpace, double>& p) {
  const auto local = silhouetteView.camera.cameraFromWorld(p);
  const auto pixel = capture::project(silhouetteView.camera.lens, local);
  const bool isInImage = pixel && capture::contains(silhouetteView.camera.lens, *pixel);
  if (!isInImage && silhouetteView.outline.isCropped()) return std::nullopt;
  if (!pixel) return -std::numeric_limits<double>::infinity();
  return silhouetteView.outline.signedDistance(*pixel) * footprintAt(silhouetteView.camera.lens, local);
}

double projectedRadius(const capture::Camera<AcquisitionSpace>& camera, const Ball& ball) {
  const capture::Lens& lens = camera.lens;
  const double focal = std::max(lens.focalX, lens.focalY);
  if (lens.model == capture::Lens::Model::orthographic) return focal * ball.radius;
  const auto local = camera.cameraFromWorld(ball.center);
  const double depth = -local.z();
  if (!(depth > ball.radius)) return std::numeric_limits<double>::infinity();
  const Vec2<double> x(local.x() / depth, -local.y() / depth);
  const double stretch = lens.distorts() ? capture::distortionJacobian(lens, x).norm() : 1;
  return stretch * focal * ball.radius * std::sqrt(1 + x.squaredNorm()) / (depth - ball.radius);
}

BallVote voteOn(const SilhouetteView& silhouetteView, const Ball& ball) {
  constexpr double kSlack = 1; // pixels
  const auto& camera = silhouetteView.camera;
  const bool isCropped = silhouetteView.outline.isCropped(),
             isPinhole = camera.lens.model == capture::Lens::Model::pinhole;
  if (isPinhole && camera.cameraFromWorld(ball.center).z() >= ball.radius)
    return {.votes = !isCropped, .inside = isCropped, .outside = !isCropped};
  const double reach = projectedRadius(camera, ball) + kSlack;
  const auto pixel = camera.project(ball.center);
  if (!pixel || !std::isfinite(reach)) return {.votes = !isCropped, .mayAgree = true};
  const double border = borderDistance(camera.lens, *pixel);
  const double distance = silhouetteView.outline.signedDistance(*pixel);
  const double change =
      (border < reach ? 2 : 1) * reach; // outside of the image the distance changes twice as fast
  if (!isCropped) return {true, distance > -change, distance > change, distance < -change};
  const bool isBeside = border < -reach, votes = border >= reach;
  return {votes, !isBeside && distance > -change, isBeside || distance > change, votes && distance < -change};
}

Point3<AcquisitionSpace, double> pointInView(std::span<const SilhouetteView> silhouetteViews) {
  Mat3<double> sum = Mat3<double>::Zero();
  Vec3<double> weighted = Vec3<double>::Zero();
  for (const SilhouetteView& silhouetteView : silhouetteViews) {
    const auto ray = capture::rayThrough(silhouetteView.camera.lens, silhouetteView.outline.centroid());
    if (!ray) continue;
    const auto worldFromCamera = silhouetteView.camera.cameraFromWorld.inverse();
    const Vec3<double> d = worldFromCamera(ray->direction).raw();
    const Mat3<double> aside = Mat3<double>::Identity() - d * d.transpose();
    sum += aside;
    weighted += aside * worldFromCamera(ray->origin).raw();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(sum);
  constexpr double kSpread = 1e-3; // mean squared sine of the angles between the rays: two degrees
  if (!(solver.eigenvalues()[0] > kSpread * static_cast<double>(silhouetteViews.size())))
    throw Error("all views look along one line, on which silhouettes say nothing of the object's depth");
  return assume<Point3<AcquisitionSpace, double>>(
      solver.eigenvectors() *
      solver.eigenvalues().cwiseInverse().cwiseProduct(solver.eigenvectors().transpose() * weighted));
}

size_t quorumOf(std::span<const SilhouetteView> silhouetteViews) {
  const auto p = pointInView(silhouetteViews);
  const auto containing = std::ranges::count_if(silhouetteViews, [&](const SilhouetteView& silhouetteView) {
    return coneDistance(silhouetteView, p).has_value();
  });
  return std::max<size_t>(2, (static_cast<size_t>(containing) + 1) / 2);
}

double hullDistance(std::span<const SilhouetteView> silhouetteViews, size_t quorum,
                    const Point3<AcquisitionSpace, double>& p, double limit) {
  double least = limit;
  size_t votes = 0;
  for (const SilhouetteView& silhouetteView : silhouetteViews) {
    const auto distance = coneDistance(silhouetteView, p);
    if (!distance) continue;
    if (!(*distance > -limit)) return -limit;
    least = std::min(least, *distance);
    ++votes;
  }
  return votes < quorum ? -limit : least;
}

Region classify(std::span<const SilhouetteView> silhouetteViews, size_t quorum, const Ball& ball) {
  size_t votes = 0, mayAgree = 0;
  bool inside = true;
  for (const SilhouetteView& silhouetteView : silhouetteViews) {
    const BallVote vote = voteOn(silhouetteView, ball);
    if (vote.outside) return Region::outside;
    votes += vote.votes;
    mayAgree += vote.mayAgree;
    inside = inside && vote.inside;
  }
  if (mayAgree < quorum) return Region::outside;
  return inside && votes >= quorum ? Region::inside : Region::mixed;
}

} // namespace surflect::hull
