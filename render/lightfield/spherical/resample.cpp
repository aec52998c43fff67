#include "render/lightfield/spherical/resample.h"

#include "render/lightfield/common/pull_push.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"

#include <Eigen/Core>

#include <algorithm>

namespace surflect::spherical {

Sphere sphereAround(const TriangleMesh& mesh, int size) {
  Sphere sphere{middleOf(mesh.positions).raw(), 0};
  for (const auto& p : mesh.positions)
    sphere.radius = std::max(sphere.radius, (p.raw().cast<double>() - sphere.middle).norm());
  if (!(sphere.radius > 0)) throw Error("has no extent").at("mesh");
  constexpr double kBorder = 1.5; // texels
  sphere.radius *= size / (size - 2 * kBorder);
  return sphere;
}

std::vector<Height> continuedHeights(std::span<const float> heights, const std::vector<bool>& isOnObject,
                                     int size) {
  std::vector<Eigen::Vector4f> texels;
  for (size_t i = 0; i < heights.size(); ++i)
    texels.emplace_back(heights[i], 0.f, 0.f, isOnObject[i] ? 1.f : 0.f);
  lightfield::pullPush(texels, size, size);
  std::vector<Height> result;
  for (const Eigen::Vector4f& texel : texels) result.push_back(heightOf(static_cast<double>(texel[0])));
  return result;
}

ResampledImage resampled(const lightfield::RayRadiance& rays, const Sphere& sphere,
                         const Vec3<double>& direction, int size, const Progress& progress) {
  using Kind = lightfield::RaySample::Kind;
  const ImageAxes axes = axesOf(direction);
  const size_t texels = static_cast<size_t>(size) * static_cast<size_t>(size);
  std::vector<Eigen::Vector4f> colors(texels);
  std::vector<Kind> kinds(texels);
  ResampledImage result;
  std::vector<float> heights(texels); // on the object
  const auto towards = assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(-direction));
  for (size_t texel = 0; texel < texels; ++texel) {
    progress.checkNowAndThen(texel);
    const double column = static_cast<double>(texel % static_cast<size_t>(size));
    const double row = static_cast<double>(texel / static_cast<size_t>(size));
    // From just outside the sphere.
    constexpr double kStart = 0.75;
    const Vec3<double> start(pointOf(sphere, axes, {(column + 0.5) / size, (row + 0.5) / size, kStart}));
    const lightfield::RaySample sample = rays.along(assume<Point3<AcquisitionSpace, double>>(start), towards);
    kinds[texel] = sample.kind;
    colors[texel] << sample.color, sample.kind == Kind::seen ? 1.f : 0.f;
    if (sample.kind != Kind::missed)
      heights[texel] = static_cast<float>(kStart - sample.distance / (2 * sphere.radius));
  }
  result.seen = static_cast<size_t>(std::ranges::count(kinds, Kind::seen));
  result.unseen = static_cast<size_t>(std::ranges::count(kinds, Kind::unseen));
  if (result.unseen > 0) lightfield::pullPush(colors, size, size);
  std::vector<bool> isOnObject;
  for (const Kind kind : kinds) isOnObject.push_back(kind != Kind::missed);
  result.heights = continuedHeights(heights, isOnObject, size);
  result.colors.assign(texels, Texel{});
  for (size_t texel = 0; texel < texels; ++texel) {
    if (kinds[texel] == Kind::missed) continue;
    for (int channel = 0; channel < 3; ++channel)
      result.colors[texel][static_cast<size_t>(channel)] = image::finiteHalf(colors[texel][channel]);
    result.colors[texel][3] = image::nearestHalf(1);
  }
  return result;
}

} // namespace surflect::spherical
