#include "srf/proxy/relief/integrate.h"

#include "srf/proxy/relief/frontal_plane.h"
#include "srf/proxy/relief/potential.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::relief {

namespace {

constexpr double kUnknown = 1e-4; // weight of an unknown difference
constexpr double kGrazing = 0.1;  // smallest cosine between normal and viewer

Vec3<double> towardsViewer(const capture::Lens& lens, const Vec2<double>& q) {
  return lens.model == capture::Lens::Model::orthographic ? Vec3<double>(0, 0, 1)
                                                          : Vec3<double>(-q[0], -q[1], 1).normalized();
}

// Weight of a normal. Its error enters gradients as 1 / cosine^2; weights are inverse variances, with a
// minimum for unknown normals.
double trust(const Vec3<double>& n, const Vec3<double>& viewer) {
  if (n.isZero()) return kUnknown;
  const double cosine = std::max(kGrazing, n.normalized().dot(viewer));
  return cosine * cosine;
}

} // namespace

Vec2<double> depthGradient(const capture::Lens& lens, const Vec2<double>& q, const Vec3<double>& normal) {
  if (normal.isZero()) return Vec2<double>::Zero();
  const Vec3<double> viewer = towardsViewer(lens, q);
  Vec3<double> n = normal.normalized();
  if (const double cosine = n.dot(viewer); cosine < kGrazing) n += (kGrazing - cosine) * viewer;
  const double unit = lens.model == capture::Lens::Model::orthographic ? 1 : std::sqrt(1 + q.squaredNorm());
  return Vec2<double>(n[0], n[1]) / (unit * n.dot(viewer));
}

DepthMap integrateNormals(const capture::Camera<AcquisitionSpace>& camera, const image::Image& normals,
                          const image::Mask& wanted, const Progress& progress) {
  assert(normals.channels == 3 && normals.width == wanted.width && normals.height == wanted.height);
  progress("relief", 0);
  const size_t width = static_cast<size_t>(wanted.width), pixels = wanted.inside.size();
  const std::vector<Vec2<double>> zeros(pixels, Vec2<double>::Zero());
  DepthMap map{wanted, std::vector<double>(pixels, 0), zeros};
  std::vector<Vec2<double>> points = zeros;
  std::vector<double> weight(pixels, 0);
  for (size_t i = 0; i < pixels; ++i) {
    if (!map.mask.inside[i]) continue;
    const auto q =
        imagePoint(camera.lens, {static_cast<double>(i % width) + 0.5, static_cast<double>(i / width) + 0.5});
    map.mask.inside[i] = q.has_value();
    if (!q) continue;
    points[i] = *q;
    const Vec3<double> n = camera.cameraFromWorld.rotation() *
                           Eigen::Map<const Vec3<float>>(&normals.values[3 * i]).cast<double>();
    map.gradient[i] = depthGradient(camera.lens, points[i], n);
    weight[i] = trust(n, towardsViewer(camera.lens, points[i]));
  }

  // Trapezoidal rule: exact if depth (or its logarithm) is quadratic. Unknown neighbours are ignored.
  const auto isKnown = [&](size_t i) { return weight[i] > kUnknown; };
  Differences differences(map.mask);
  const auto set = [&](double& difference, double& edge, size_t i, size_t j) {
    if (edge == 0) return;
    const Vec2<double> sum = map.gradient[i] + map.gradient[j];
    difference = sum.dot(points[j] - points[i]) / (isKnown(i) == isKnown(j) ? 2 : 1);
    edge = std::min(weight[i], weight[j]);
  };
  for (size_t i = 0; i < pixels; ++i) {
    set(differences.right[i], differences.rightWeight[i], i, i + 1);
    set(differences.down[i], differences.downWeight[i], i, i + width);
  }
  const auto potential = potentialOf(differences, progress);
  const double middle = frontalDepth(camera);
  for (size_t i = 0; i < potential.size(); ++i)
    if (map.mask.inside[i])
      map.depth[i] = camera.lens.model == capture::Lens::Model::orthographic
                         ? middle + potential[i]
                         : middle * std::exp(potential[i]);
  progress("relief", 1);
  return map;
}

} // namespace surflect::relief
