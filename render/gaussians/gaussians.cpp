#include "render/gaussians/gaussians.h"

#include "srf/image/color.h"
#include "surfel/math/sphere_sampling.h"

#include <Eigen/SVD>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::gaussians {

namespace {

// Directions all around, of which a surfel faces half: twice as many as a fit has coefficients, or more.
size_t directionsFor(int degree) { return std::max<size_t>(16, 4 * coefficientsOf(degree)); }

// Cosine to the normal at which a direction begins to count.
constexpr double kLeastCosine = 0.1;

// Encoded colour of radiance that is not premultiplied.
Color encoded(Rgb radiance, double scale) {
  const auto encode = [&](float value) {
    const double linear = std::clamp(scale * value, 0.0, 1.0);
    return double{image::srgbFromLinear(static_cast<float>(linear))};
  };
  return {encode(radiance.r), encode(radiance.g), encode(radiance.b)};
}

struct Ellipse {
  Vec3<double> major, minor; // unit
  double longer, shorter;    // half-axes
};

// Principal axes of the ellipse a u + b v, a^2 + b^2 = 1.
Ellipse principalAxes(const Vec3<double>& u, const Vec3<double>& v) {
  Eigen::Matrix<double, 3, 2> tangents;
  tangents << u, v;
  const Eigen::JacobiSVD<Eigen::Matrix<double, 3, 2>> svd(tangents, Eigen::ComputeFullU);
  return {svd.matrixU().col(0), svd.matrixU().col(1), svd.singularValues()[0], svd.singularValues()[1]};
}

} // namespace

Shape shapeOf(const Point3<ObjectSpace>& p, const Direction3<ObjectSpace>& u,
              const Direction3<ObjectSpace>& v, Handedness handedness, float radius) {
  assert(handedness != Handedness::dead);
  const Vec3<double> ju = u.raw().cast<double>(), jv = v.raw().cast<double>();
  const auto [major, minor, longer, shorter] = principalAxes(ju, jv);
  const double side = handedness == Handedness::mirrored ? -1 : 1;
  Mat3<double> axes;
  axes.col(0) = major;
  axes.col(2) = side * ju.cross(jv).normalized();
  axes.col(1) = axes.col(2).cross(major); // along `minor` or against it, so that the axes are right-handed
  Eigen::Quaterniond turn(axes);
  if (turn.w() < 0) turn.coeffs() *= -1;
  const double deviation = kDeviationPerRadius * radius;
  Shape shape;
  shape.center = p.raw();
  shape.normal = axes.col(2).cast<float>();
  shape.scale = {static_cast<float>(deviation * longer), static_cast<float>(deviation * shorter),
                 static_cast<float>(kThickness * deviation * shorter)};
  shape.rotation = {static_cast<float>(turn.w()), static_cast<float>(turn.x()), static_cast<float>(turn.y()),
                    static_cast<float>(turn.z())};
  return shape;
}

Gaussians::Gaussians(const surfels::OutgoingRadiance& radiance) : radiance_(radiance) {
  const DeformedCloud& deformed = radiance.deformed();
  for (uint32_t i = 0; i < deformed.size(); ++i)
    if (deformed.handedness[i] != Handedness::dead && radiance.cloud().radius[i] > 0) alive_.push_back(i);
}

Shape Gaussians::shape(size_t i) const {
  const uint32_t surfel = alive_[i];
  const DeformedCloud& deformed = radiance_.deformed();
  return shapeOf(deformed.p[surfel], deformed.u[surfel], deformed.v[surfel], deformed.handedness[surfel],
                 radiance_.cloud().radius[surfel]);
}

std::vector<Look> Gaussians::looks(size_t begin, size_t end, const LookOptions& options,
                                   const Progress& progress) const {
  assert(begin <= end && end <= size());
  const std::vector<Vec3<double>> viewers = fibonacciSphere(directionsFor(options.degree));
  std::vector<std::array<double, kMostCoefficients>> harmonics;
  for (const Vec3<double>& viewer : viewers) harmonics.push_back(harmonicsAt(-viewer));

  // Sample k of a surfel is its colour towards viewers[k], with weight 0 where it faces away.
  const size_t count = end - begin, directions = viewers.size();
  std::vector<float> samples(4 * count * directions);
  std::vector<Vec3<float>> normals;
  for (size_t i = begin; i < end; ++i) normals.push_back(shape(i).normal);
  std::vector<uint32_t> facing, places;
  for (size_t k = 0; k < directions; ++k) {
    progress(kStage, static_cast<double>(k) / static_cast<double>(directions));
    facing.clear();
    places.clear();
    for (size_t i = 0; i < count; ++i) {
      if (normals[i].cast<double>().dot(viewers[k]) < kLeastCosine) continue;
      facing.push_back(alive_[begin + i]);
      places.push_back(static_cast<uint32_t>(i));
    }
    const shading::Shaded shaded = radiance_.towards(assume<Direction3<ObjectSpace, double>>(viewers[k]),
                                                     facing, {{}, progress.cancelled});
    for (size_t f = 0; f < facing.size(); ++f) {
      const double alpha = shaded.alpha.empty() ? 1 : shaded.alpha[f];
      if (!(alpha > 0)) continue;
      const Color color = encoded(shaded.radiance[f], options.exposure / alpha);
      float* sample = &samples[4 * (places[f] * directions + k)];
      for (size_t channel = 0; channel < 3; ++channel) sample[channel] = static_cast<float>(color[channel]);
      sample[3] = static_cast<float>(alpha);
    }
  }

  std::vector<Look> looks(count);
  tbb::parallel_for(size_t{0}, count, [&](size_t i) {
    progress.checkNowAndThen(i);
    std::vector<Color> colors(directions);
    std::vector<double> weights(directions);
    double seen = 0, covered = 0;
    for (size_t k = 0; k < directions; ++k) {
      const float* sample = &samples[4 * (i * directions + k)];
      const double cosine = normals[i].cast<double>().dot(viewers[k]);
      if (cosine < kLeastCosine) continue;
      colors[k] = {sample[0], sample[1], sample[2]};
      weights[k] = cosine * sample[3];
      seen += cosine;
      covered += weights[k];
    }
    looks[i].color = fitted(harmonics, colors, weights, options.degree);
    looks[i].opacity = seen > 0 ? static_cast<float>(kOpacity * covered / seen) : 0;
  });
  return looks;
}

} // namespace surflect::gaussians
