#include "srf/calibration/chrome_ball.h"

#include "surfel/math/median.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::calibration {

namespace {

constexpr size_t kFewestOutline = 12;
constexpr int kOutlineRounds = 10;
constexpr double kOutlierDeviations = 3 * 1.4826; // of the median, by which a normal distribution has its own
constexpr double kRoundedOutline = 0.002;         // of the radius: exact outlines are kept whole
constexpr double kKnownDistance = 0.25;           // standard error over distance
constexpr double kMostOfBall = 0.1;               // share of the ball that a highlight may fill

// Circle through the origins of parallel rays.
// x^2 + y^2 = 2 a x + 2 b y + c, with the centre (a, b) and c = R^2 - a^2 - b^2
std::optional<Ball> ballOfParallelRays(std::span<const capture::CameraRay> rays) {
  Mat3<double> moments = Mat3<double>::Zero();
  Vec3<double> right = Vec3<double>::Zero();
  for (const auto& ray : rays) {
    const Vec3<double> at = ray.origin.raw(), row(2 * at.x(), 2 * at.y(), 1);
    moments += row * row.transpose();
    right += (at.x() * at.x() + at.y() * at.y()) * row;
  }
  const Vec3<double> fit = moments.ldlt().solve(right);
  const double square = fit.z() + fit.x() * fit.x() + fit.y() * fit.y();
  if (!fit.allFinite() || !(square > 0)) return std::nullopt;
  return Ball{{fit.x(), fit.y(), 0}, std::sqrt(square)};
}

// Cone of rays from the eye. r . m = 1 for m = a / cos(angle)
std::optional<Ball> ballOfCone(std::span<const capture::CameraRay> rays, double radius) {
  Mat3<double> moments = Mat3<double>::Zero();
  Vec3<double> right = Vec3<double>::Zero();
  for (const auto& ray : rays) {
    moments += ray.direction.raw() * ray.direction.raw().transpose();
    right += ray.direction.raw();
  }
  const Vec3<double> m = moments.ldlt().solve(right);
  const double cosine = 1 / m.norm();
  if (!m.allFinite() || !(cosine < 1)) return std::nullopt;
  return Ball{radius / std::sqrt(1 - cosine * cosine) * m.normalized(), radius};
}

// Distance of a ray from the rim of the ball, over its radius as seen.
double offRim(const capture::CameraRay& ray, const Ball& ball, bool isParallel) {
  if (isParallel) return std::abs((ray.origin.raw() - ball.center).head<2>().norm() / ball.radius - 1);
  const Vec3<double> d = ray.direction.raw();
  const double angle = std::atan2(d.cross(ball.center).norm(), d.dot(ball.center));
  return std::abs(angle / std::asin(std::min(1.0, ball.radius / ball.center.norm())) - 1);
}

} // namespace

std::optional<Ball> ballOfOutline(const capture::Lens& lens, std::span<const capture::Pixel> outline,
                                  double radius) {
  std::vector<capture::CameraRay> all;
  for (const capture::Pixel& pixel : outline) {
    const auto ray = capture::rayThrough(lens, pixel);
    if (!ray) return std::nullopt;
    all.push_back(*ray);
  }
  const bool isParallel = lens.model == capture::Lens::Model::orthographic;
  std::vector<capture::CameraRay> kept = all;
  std::optional<Ball> ball;
  for (int round = 0; round < kOutlineRounds; ++round) {
    if (kept.size() < kFewestOutline || 2 * kept.size() < all.size()) return std::nullopt;
    ball = isParallel ? ballOfParallelRays(kept) : ballOfCone(kept, radius);
    if (!ball) return std::nullopt;
    std::vector<double> off;
    double squares = 0;
    for (const auto& ray : kept) squares += std::pow(offRim(ray, *ball, isParallel), 2);
    ball->misfit = std::sqrt(squares / static_cast<double>(kept.size()));
    for (const auto& ray : all) off.push_back(offRim(ray, *ball, isParallel));
    const double most = std::max(kOutlierDeviations * median(off), kRoundedOutline);
    kept.clear();
    for (size_t i = 0; i < all.size(); ++i)
      if (off[i] <= most) kept.push_back(all[i]);
  }
  return ball;
}

std::vector<capture::Pixel> outlineOf(const image::Image& coverage) {
  std::vector<capture::Pixel> outline;
  const auto crossing = [&](int x, int y, int dx, int dy) {
    const double a = static_cast<double>(coverage.at(x, y)[0]) - 0.5,
                 b = static_cast<double>(coverage.at(x + dx, y + dy)[0]) - 0.5;
    if ((a > 0) == (b > 0)) return;
    const double t = a / (a - b);
    outline.push_back({x + 0.5 + t * dx, y + 0.5 + t * dy});
  };
  for (int y = 0; y < coverage.height; ++y)
    for (int x = 0; x < coverage.width; ++x) {
      if (x + 1 < coverage.width) crossing(x, y, 1, 0);
      if (y + 1 < coverage.height) crossing(x, y, 0, 1);
    }
  return outline;
}

std::optional<capture::Pixel> highlightOf(const image::Image& luminance, const image::Image& coverage) {
  assert(luminance.channels == 1 && luminance.values.size() == coverage.values.size());
  const auto index = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(luminance.width) + static_cast<size_t>(x);
  };
  size_t covered = 0, brightest = 0;
  float most = 0;
  for (size_t i = 0; i < luminance.values.size(); ++i) {
    if (!(coverage.values[i] > 0.5f)) continue;
    ++covered;
    if (luminance.values[i] > most) most = luminance.values[i], brightest = i;
  }
  if (!(most > 0)) return std::nullopt;
  const auto width = static_cast<size_t>(luminance.width);
  std::vector<bool> isSeen(luminance.values.size());
  std::vector<size_t> open{brightest};
  isSeen[brightest] = true;
  double sumX = 0, sumY = 0, weights = 0;
  size_t count = 0;
  while (!open.empty()) {
    const size_t i = open.back();
    open.pop_back();
    const int x = static_cast<int>(i % width), y = static_cast<int>(i / width);
    // Pixels that come in as the threshold falls come in with weight 0.
    const double weight = static_cast<double>(luminance.values[i] - 0.5f * most);
    sumX += weight * (x + 0.5);
    sumY += weight * (y + 0.5);
    weights += weight;
    ++count;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        if (x + dx < 0 || y + dy < 0 || x + dx >= luminance.width || y + dy >= luminance.height) continue;
        const size_t next = index(x + dx, y + dy);
        if (isSeen[next] || !(coverage.values[next] > 0.5f) || !(luminance.values[next] > 0.5f * most))
          continue;
        isSeen[next] = true;
        open.push_back(next);
      }
  }
  if (static_cast<double>(count) > kMostOfBall * static_cast<double>(covered)) return std::nullopt;
  return capture::Pixel{sumX / weights, sumY / weights};
}

std::optional<MirrorRay> mirrorRay(const capture::Lens& lens, const Ball& ball, capture::Pixel pixel) {
  const auto ray = capture::rayThrough(lens, pixel);
  if (!ray) return std::nullopt;
  const Vec3<double> d = ray->direction.raw(), o = ray->origin.raw() - ball.center;
  const double b = o.dot(d), discriminant = b * b - o.squaredNorm() + ball.radius * ball.radius;
  if (!(discriminant >= 0)) return std::nullopt;
  const Vec3<double> n = (o + (-b - std::sqrt(discriminant)) * d) / ball.radius;
  return MirrorRay{ball.center + ball.radius * n, d - 2 * n.dot(d) * n,
                   -n.dot(d)}; // l = 2 (n . v) n - v, v = -d
}

std::optional<Ball> ballOfViews(std::span<const capture::Camera<AcquisitionSpace>> cameras,
                                std::span<const Ball> ofUnitRadius) {
  assert(cameras.size() == ofUnitRadius.size());
  Mat3<double> moments = Mat3<double>::Zero();
  Vec3<double> right = Vec3<double>::Zero();
  for (size_t v = 0; v < cameras.size(); ++v) {
    const Vec3<double> eye = cameras[v].center().raw();
    const Vec3<double> axis =
        (cameras[v].cameraFromWorld.rotation().transpose() * ofUnitRadius[v].center).normalized();
    const Mat3<double> across = Mat3<double>::Identity() - axis * axis.transpose();
    moments += across;
    right += across * eye;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(moments);
  if (!(solver.eigenvalues()[0] > 1e-4 * solver.eigenvalues()[2])) return std::nullopt;
  Ball ball{moments.inverse() * right, 0};
  double squares = 0; // distances of the axes from the centre
  for (size_t v = 0; v < cameras.size(); ++v) {
    const Vec3<double> from = ball.center - cameras[v].center().raw();
    const Vec3<double> axis = cameras[v].cameraFromWorld.rotation().transpose() * ofUnitRadius[v].center;
    // A ball of radius 1 would be that much farther away.
    ball.radius += from.norm() / axis.norm() / static_cast<double>(cameras.size());
    squares += from.cross(axis.normalized()).squaredNorm() / static_cast<double>(cameras.size());
  }
  ball.misfit = std::sqrt(squares) / ball.radius;
  return ball;
}

LampOfRays lampOfRays(std::span<const MirrorRay> rays, bool mayBeNear) {
  LampOfRays lamp;
  lamp.errorOfDistance = std::numeric_limits<double>::infinity();
  Vec3<double> mean = Vec3<double>::Zero(), start = Vec3<double>::Zero();
  double weights = 0;
  for (const MirrorRay& ray : rays) {
    mean += ray.cosine * ray.cosine * ray.towards;
    weights += ray.cosine * ray.cosine;
    start += ray.from / static_cast<double>(rays.size());
  }
  lamp.towards = mean.normalized();
  const auto spreadOf = [&](const auto& towardsFrom) {
    double squares = 0;
    for (const MirrorRay& ray : rays)
      squares +=
          ray.cosine * ray.cosine *
          std::pow(std::atan2(ray.towards.cross(towardsFrom(ray)).norm(), ray.towards.dot(towardsFrom(ray))),
                   2);
    return std::sqrt(squares / weights);
  };
  lamp.spread = spreadOf([&](const MirrorRay&) { return lamp.towards; });
  if (rays.size() < 2 || !mayBeNear) return lamp;
  // The place nearest to the rays in angle: distances across a ray count by the distance along it.
  Vec3<double> place = start;
  Mat3<double> moments;
  for (int round = 0; round < 5; ++round) {
    moments.setZero();
    Vec3<double> right = Vec3<double>::Zero();
    for (const MirrorRay& ray : rays) {
      const double along = (round == 0 ? 1 : (place - ray.from).squaredNorm()) / (ray.cosine * ray.cosine);
      const Mat3<double> across =
          (Mat3<double>::Identity() - ray.towards * ray.towards.transpose()) / std::max(along, 1e-30);
      moments += across;
      right += across * ray.from;
    }
    const Vec3<double> solved = moments.ldlt().solve(right);
    if (!solved.allFinite()) return lamp;
    place = solved;
  }
  const Vec3<double> from = place - start;
  const double spread = spreadOf([&](const MirrorRay& ray) -> Vec3<double> { return place - ray.from; });
  // Two angles of each ray, and three coordinates.
  const double freedom = std::max(1.0, 2.0 * static_cast<double>(rays.size()) - 3);
  const double variance = std::max(spread * spread * weights / freedom, 1e-12);
  const Vec3<double> towards = from.normalized();
  lamp.errorOfDistance = std::sqrt(variance * towards.dot(moments.inverse() * towards)) / from.norm();
  if (!(lamp.errorOfDistance <= kKnownDistance) || !(from.dot(lamp.towards) > 0)) return lamp;
  lamp.isNear = true;
  lamp.place = place;
  lamp.towards = towards;
  lamp.spread = spread;
  return lamp;
}

} // namespace surflect::calibration
