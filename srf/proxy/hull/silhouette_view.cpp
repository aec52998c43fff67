#include "srf/proxy/hull/silhouette_view.h"

#include "surfel/base/error.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>

namespace surflect::hull {

namespace {

constexpr float kContour = 0.5f;

struct Segment {
  float x0, y0, x1, y1; // pixel centres lie at integers
};

float squaredDistance(const Segment& s, float x, float y) {
  const float dx = s.x1 - s.x0, dy = s.y1 - s.y0, px = x - s.x0, py = y - s.y0;
  const float squared = dx * dx + dy * dy;
  const float t = squared > 0 ? std::clamp((px * dx + py * dy) / squared, 0.f, 1.f) : 0;
  const float ex = px - t * dx, ey = py - t * dy;
  return ex * ex + ey * ey;
}

// Marching squares; calls use(segment) for the at most two in the square that starts at (x, y).
template <class Use> void contourOfSquare(const image::Image& alpha, int x, int y, const Use& use) {
  constexpr int kCorner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  float value[4];
  for (int c = 0; c < 4; ++c) value[c] = alpha.at(x + kCorner[c][0], y + kCorner[c][1])[0] - kContour;
  std::array<Vec2<float>, 4> crossing; // on the sides, from corner c to c + 1
  int count = 0;
  for (int c = 0; c < 4; ++c) {
    const int d = (c + 1) % 4;
    if ((value[c] > 0) == (value[d] > 0)) continue;
    const float t = value[c] / (value[c] - value[d]);
    crossing[static_cast<size_t>(count++)] = {
        static_cast<float>(x + kCorner[c][0]) + t * static_cast<float>(kCorner[d][0] - kCorner[c][0]),
        static_cast<float>(y + kCorner[c][1]) + t * static_cast<float>(kCorner[d][1] - kCorner[c][1])};
  }
  const auto join = [&](size_t a, size_t b) {
    use(Segment{crossing[a][0], crossing[a][1], crossing[b][0], crossing[b][1]});
  };
  if (count == 2) join(0, 1);
  if (count < 4) return;
  // Ambiguous case with opposite corners alike: the value in the middle decides which pair is joined.
  const bool middleInside = value[0] + value[1] + value[2] + value[3] > 0;
  if (middleInside == (value[0] > 0)) {
    join(0, 1); // around corner 1
    join(2, 3); // around corner 3
  } else {
    join(3, 0);
    join(1, 2);
  }
}

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// Nearest contour segment of each pixel, propagated between neighbours [Danielsson 1980, 8SED].
class NearestSegments {
public:
  explicit NearestSegments(const image::Image& alpha)
      : width_(alpha.width), height_(alpha.height), nearest_(alpha.values.size(), kNone),
        squared_(alpha.values.size(), std::numeric_limits<float>::infinity()) {
    for (int y = 0; y + 1 < height_; ++y)
      for (int x = 0; x + 1 < width_; ++x)
        contourOfSquare(alpha, x, y, [&](const Segment& segment) {
          segments_.push_back(segment);
          const auto index = static_cast<uint32_t>(segments_.size() - 1);
          for (int corner = 0; corner < 4; ++corner) offer(index, x + corner % 2, y + corner / 2);
        });
    if (segments_.empty()) return;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x)
        for (const auto& [dx, dy] : {std::pair{-1, 0}, {-1, -1}, {0, -1}, {1, -1}}) take(x, y, dx, dy);
      for (int x = width_ - 1; x >= 0; --x) take(x, y, 1, 0);
    }
    for (int y = height_ - 1; y >= 0; --y) {
      for (int x = width_ - 1; x >= 0; --x)
        for (const auto& [dx, dy] : {std::pair{1, 0}, {1, 1}, {0, 1}, {-1, 1}}) take(x, y, dx, dy);
      for (int x = 0; x < width_; ++x) take(x, y, -1, 0);
    }
  }

  bool none() const { return segments_.empty(); }
  float distance(size_t pixel) const { return std::sqrt(squared_[pixel]); }

private:
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
  }
  void offer(uint32_t segment, int x, int y) {
    const size_t pixel = at(x, y);
    if (segment == kNone || segment == nearest_[pixel]) return;
    const float squared = squaredDistance(segments_[segment], static_cast<float>(x), static_cast<float>(y));
    if (!(squared < squared_[pixel])) return;
    squared_[pixel] = squared;
    nearest_[pixel] = segment;
  }
  void take(int x, int y, int dx, int dy) {
    if (x + dx >= 0 && x + dx < width_ && y + dy >= 0 && y + dy < height_)
      offer(nearest_[at(x + dx, y + dy)], x, y);
  }

  int width_, height_;
  std::vector<Segment> segments_;
  std::vector<uint32_t> nearest_;
  std::vector<float> squared_;
};

} // namespace

Outline::Outline(const image::Image& alpha) : centroid_{alpha.width / 2.0, alpha.height / 2.0} {
  assert(alpha.channels == 1 && alpha.width > 0 && alpha.height > 0);
  const NearestSegments nearest(alpha);
  image::Image distances(alpha.width, alpha.height, 1);
  const auto far = static_cast<float>(alpha.width + alpha.height);
  double sumX = 0, sumY = 0, count = 0;
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x) {
      const size_t pixel = static_cast<size_t>(y) * static_cast<size_t>(alpha.width) + static_cast<size_t>(x);
      const bool inside = alpha.values[pixel] > kContour;
      const float distance = nearest.none() ? far : nearest.distance(pixel);
      distances.values[pixel] = inside ? std::max(distance, std::numeric_limits<float>::min())
                                       : -distance; // the sign follows the mask
      if (!inside) continue;
      sumX += x + 0.5, sumY += y + 0.5, ++count;
      isCropped_ |= x == 0 || y == 0 || x == alpha.width - 1 || y == alpha.height - 1;
    }
  distances_ = std::make_shared<const image::Image>(std::move(distances));
  isEmpty_ = count == 0;
  if (!isEmpty_) centroid_ = {sumX / count, sumY / count};
}

image::Mask Outline::mask() const {
  image::Mask mask(width(), height());
  for (size_t i = 0; i < mask.inside.size(); ++i) mask.inside[i] = distances_->values[i] > 0;
  return mask;
}

double Outline::signedDistance(capture::Pixel pixel) const {
  const double x = std::clamp(pixel.x - 0.5, 0.0, width() - 1.0),
               y = std::clamp(pixel.y - 0.5, 0.0, height() - 1.0);
  const int x0 = std::min(static_cast<int>(x), std::max(width() - 2, 0)),
            y0 = std::min(static_cast<int>(y), std::max(height() - 2, 0));
  const int x1 = std::min(x0 + 1, width() - 1), y1 = std::min(y0 + 1, height() - 1);
  const double fx = x - x0, fy = y - y0;
  const auto value = [&](int column, int row) { return static_cast<double>(distances_->at(column, row)[0]); };
  const double beyondX = pixel.x - std::clamp(pixel.x, 0.0, static_cast<double>(width())),
               beyondY = pixel.y - std::clamp(pixel.y, 0.0, static_cast<double>(height()));
  return (1 - fy) * ((1 - fx) * value(x0, y0) + fx * value(x1, y0)) +
         fy * ((1 - fx) * value(x0, y1) + fx * value(x1, y1)) -
         (beyondX == 0 && beyondY == 0 ? 0 : std::hypot(beyondX, beyondY)); // most pixels are in the image
}

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

namespace {

// projectedRadius of a ball around a point of the camera.
double projectedRadius(const capture::Lens& lens, const Point3<CameraSpace, double>& center, double radius) {
  const double focal = std::max(lens.focalX, lens.focalY);
  if (lens.model == capture::Lens::Model::orthographic) return focal * radius;
  const double depth = -center.z();
  if (!(depth > radius)) return std::numeric_limits<double>::infinity();
  const Vec2<double> x(center.x() / depth, -center.y() / depth);
  const double stretch = lens.distorts() ? capture::distortionJacobian(lens, x).norm() : 1;
  return stretch * focal * radius * std::sqrt(1 + x.squaredNorm()) / (depth - radius);
}

} // namespace

double projectedRadius(const capture::Camera<AcquisitionSpace>& camera, const Ball& ball) {
  return projectedRadius(camera.lens, camera.cameraFromWorld(ball.center), ball.radius);
}

BallVote voteOn(const SilhouetteView& silhouetteView, const Ball& ball) {
  constexpr double kSlack = 1; // pixels
  const capture::Lens& lens = silhouetteView.camera.lens;
  const auto center = silhouetteView.camera.cameraFromWorld(ball.center);
  const bool isCropped = silhouetteView.outline.isCropped();
  if (lens.model == capture::Lens::Model::pinhole && center.z() >= ball.radius)
    return {.votes = !isCropped, .inside = isCropped, .outside = !isCropped};
  const double reach = projectedRadius(lens, center, ball.radius) + kSlack;
  const auto pixel = capture::project(lens, center);
  if (!pixel || !std::isfinite(reach)) return {.votes = !isCropped, .mayAgree = true};
  const double border = borderDistance(lens, *pixel);
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
