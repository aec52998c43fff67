#include "srf/proxy/relief/photometric.h"

#include "srf/proxy/relief/frontal_plane.h"
#include "surfel/base/error.h"
#include "surfel/math/median.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace surflect::relief {

namespace {

// Smallest root mean square distance of the light directions from their nearest plane, relative to their
// length.
constexpr double kOutOfPlane = 0.02;

double mean(Rgb c) { return (static_cast<double>(c.r) + c.g + c.b) / 3; }

// argmin_b sum_i w_i (b . l_i - y_i)^2; empty if the lights with weight lie in a plane.
std::optional<Vec3<double>> weightedFit(std::span<const Vec3<double>> l, std::span<const double> y,
                                        std::span<const double> w) {
  Mat3<double> a = Mat3<double>::Zero();
  Vec3<double> b = Vec3<double>::Zero();
  double sum = 0;
  for (size_t i = 0; i < l.size(); ++i) {
    a += w[i] * l[i] * l[i].transpose();
    b += w[i] * y[i] * l[i];
    sum += w[i];
  }
  a /= sum;
  Eigen::SelfAdjointEigenSolver<Mat3<double>> spectrum;
  spectrum.computeDirect(a, Eigen::EigenvaluesOnly); // closed form, good to 1e-8
  if (!(spectrum.eigenvalues()[0] > kOutOfPlane * kOutOfPlane)) return std::nullopt;
  return a.llt().solve(b / sum);
}

struct RobustFit {
  Vec3<double> b;               // rho n
  std::vector<double> agreeing; // 1 for lights that the fit uses, otherwise 0
};

// Robust fit: least absolute deviations by least squares reweighted by 1 / |residual|, then least squares
// without outliers. Darker samples have less weight, because they may be in shadow.
std::optional<RobustFit> robustFit(std::span<const Vec3<double>> l, std::span<const double> y) {
  constexpr int kRounds = 20;
  constexpr double kFloor = 0.01;      // of the brightest: smaller residuals count as equal
  constexpr double kOutlier = 2.5;     // times the scale  [Rousseeuw 1987, §5.1]
  constexpr double kMadScale = 1.4826; // median of absolute residuals to standard deviation, for a Gaussian
  const double floor = kFloor * *std::ranges::max_element(y);
  const double middle = std::max(floor, median({y.begin(), y.end()}));
  std::vector<double> weights(l.size(), 1), residuals(l.size());
  auto b = weightedFit(l, y, weights);
  if (!b) return std::nullopt;
  const auto rate = [&] {
    for (size_t i = 0; i < l.size(); ++i) residuals[i] = std::abs(y[i] - std::max(0.0, b->dot(l[i])));
  };
  for (int round = 0; round < kRounds; ++round) {
    rate();
    for (size_t i = 0; i < l.size(); ++i)
      weights[i] = std::clamp(y[i] / middle, 0.0, 1.0) / std::max(floor, residuals[i]);
    const auto next = weightedFit(l, y, weights);
    if (!next) break;
    b = next;
  }
  rate();
  const double limit = kOutlier * std::max(floor, kMadScale * median(residuals));
  for (size_t i = 0; i < l.size(); ++i) weights[i] = b->dot(l[i]) > 0 && residuals[i] <= limit;
  return RobustFit{weightedFit(l, y, weights).value_or(*b), weights};
}

} // namespace

LambertFit fitLambert(std::span<const Vec3<double>> l, std::span<const Rgb> y) {
  assert(l.size() == y.size());
  LambertFit fit;
  std::vector<double> gray(y.size());
  std::ranges::transform(y, gray.begin(), mean);
  if (l.size() < 3 || !(*std::ranges::max_element(gray) > 0)) return fit;
  const auto robust = robustFit(l, gray);
  if (!robust || !(robust->b.norm() > 0)) return fit;
  fit.normal = robust->b.normalized();
  const auto shading = [&](size_t i) { return std::max(0.0, fit.normal.dot(l[i])); };

  // Colours share the normal and the lights that agree on it: rho = sum s y / sum s^2 with s = max(0, n . l).
  double squares = 0;
  Vec3<double> products = Vec3<double>::Zero();
  for (size_t i = 0; i < l.size(); ++i) {
    const double s = robust->agreeing[i] * shading(i);
    squares += s * s;
    products += s * Vec3<double>(y[i].r, y[i].g, y[i].b);
  }
  if (squares > 0) {
    const Vec3<float> albedo = (products / squares).cwiseMax(0).cast<float>();
    fit.albedo = {albedo[0], albedo[1], albedo[2]};
  }
  double sum = 0;
  for (size_t i = 0; i < l.size(); ++i) {
    const Rgb error = y[i] + static_cast<float>(-shading(i)) * fit.albedo;
    sum += Vec3<double>(error.r, error.g, error.b).squaredNorm();
  }
  fit.residual = std::sqrt(sum / (3 * static_cast<double>(l.size())));
  return fit;
}

Rgb lambertRadiance(const LambertFit& fit, const Vec3<double>& l, Rgb irradiance) {
  const double s = std::max(0.0, fit.normal.dot(l)) / std::numbers::pi;
  return static_cast<float>(s) * (fit.albedo * irradiance);
}

namespace {

// Point of the frontal plane at a pixel's centre.
std::optional<Point3<AcquisitionSpace, double>> frontalPoint(const capture::Camera<AcquisitionSpace>& camera,
                                                             double depth, int x, int y) {
  const auto q = imagePoint(camera.lens, {x + 0.5, y + 0.5});
  if (!q) return std::nullopt;
  return camera.cameraFromWorld.inverse()(atDepth(camera.lens, *q, depth));
}

Rgb reflectedShare(std::span<const float> radiance, Rgb irradiance) {
  const auto share = [](float i, float e) { return std::numbers::pi_v<float> * i / e; };
  return {share(radiance[0], irradiance.r), share(radiance[1], irradiance.g),
          share(radiance[2], irradiance.b)};
}

// Throws if the lights do not determine a normal.
void checkLights(const capture::Camera<AcquisitionSpace>& camera, std::span<const capture::Light> lights) {
  if (lights.size() < 3)
    throw Error::mismatch("photographs under three lights or more, for normals",
                          std::to_string(lights.size()));
  const auto center =
      frontalPoint(camera, frontalDepth(camera), camera.lens.width / 2, camera.lens.height / 2);
  std::vector<Vec3<double>> towards;
  if (center)
    for (const capture::Light& light : lights) towards.push_back(capture::towardsLight(light, *center).raw());
  const std::vector<double> ones(towards.size(), 1);
  if (!center || !weightedFit(towards, ones, ones))
    throw Error::mismatch("lights that do not lie in a plane with the object, for normals", "such lights");
}

} // namespace

LambertFit LambertImage::at(int x, int y) const {
  const auto n = normal.at(x, y), a = albedo.at(x, y);
  return {Vec3<double>(n[0], n[1], n[2]), {a[0], a[1], a[2]}, residual.at(x, y)[0]};
}

LambertImage fitLambert(const capture::Camera<AcquisitionSpace>& camera,
                        std::span<const capture::Light> lights, std::span<const image::Image> radiance,
                        const image::Mask& mask, const Progress& progress) {
  assert(lights.size() == radiance.size());
  checkLights(camera, lights);
  const int width = mask.width, height = mask.height;
  LambertImage fits{image::Image(width, height, 3), image::Image(width, height, 3),
                    image::Image(width, height, 1)};
  const double depth = frontalDepth(camera);
  tbb::parallel_for(0, height, [&](int y) {
    progress.checkpoint();
    std::vector<Vec3<double>> towards(lights.size());
    std::vector<Rgb> shares(lights.size());
    for (int x = 0; x < width; ++x) {
      if (!mask.inside[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)])
        continue;
      const auto p = frontalPoint(camera, depth, x, y);
      if (!p) continue;
      for (size_t i = 0; i < lights.size(); ++i) {
        towards[i] = capture::towardsLight(lights[i], *p).raw();
        shares[i] = reflectedShare(radiance[i].at(x, y), capture::irradianceAt(lights[i], *p));
      }
      const LambertFit fit = fitLambert(towards, shares);
      for (size_t c = 0; c < 3; ++c)
        fits.normal.at(x, y)[c] = static_cast<float>(fit.normal[static_cast<Eigen::Index>(c)]);
      std::ranges::copy(std::array{fit.albedo.r, fit.albedo.g, fit.albedo.b}, fits.albedo.at(x, y).begin());
      fits.residual.at(x, y)[0] = static_cast<float>(fit.residual);
    }
  });
  progress("normals", 1);
  return fits;
}

image::Image relit(const LambertImage& fits, const capture::Camera<AcquisitionSpace>& camera,
                   const capture::Light& light) {
  image::Image image(fits.normal.width, fits.normal.height, 3);
  const double depth = frontalDepth(camera);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (const auto p = frontalPoint(camera, depth, x, y)) {
        const Rgb value = lambertRadiance(fits.at(x, y), capture::towardsLight(light, *p).raw(),
                                          capture::irradianceAt(light, *p));
        std::ranges::copy(std::array{value.r, value.g, value.b}, image.at(x, y).begin());
      }
  return image;
}

} // namespace surflect::relief
