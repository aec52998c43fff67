#include "srf/proxy/relief/photometric.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace surflect::relief {
namespace {

using Random = std::mt19937;

double uniform(Random& random, double from, double to) {
  return std::uniform_real_distribution(from, to)(random);
}

// A unit vector within an angle (radians) of z.
Vec3<double> nearZ(Random& random, double angle) {
  const double z = uniform(random, std::cos(angle), 1), phi = uniform(random, 0, 2 * std::numbers::pi);
  return {std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z};
}

// On a ring around z, so that no three lie in a plane with the point.
std::vector<Vec3<double>> ring(int count, double angle) {
  std::vector<Vec3<double>> lights;
  for (int i = 0; i < count; ++i) {
    const double phi = 2 * std::numbers::pi * (i + 0.3) / count;
    lights.emplace_back(std::sin(angle) * std::cos(phi), std::sin(angle) * std::sin(phi), std::cos(angle));
  }
  return lights;
}

Rgb randomAlbedo(Random& random) {
  const auto share = [&] { return static_cast<float>(uniform(random, 0.1, 0.9)); };
  return {share(), share(), share()};
}

std::vector<Rgb> shares(const Vec3<double>& n, Rgb albedo, const std::vector<Vec3<double>>& lights) {
  std::vector<Rgb> y;
  for (const auto& l : lights) y.push_back(static_cast<float>(std::max(0.0, n.dot(l))) * albedo);
  return y;
}

void expectFit(const LambertFit& fit, const Vec3<double>& n, Rgb albedo, double tolerance) {
  EXPECT_LT((fit.normal - n).norm(), tolerance);
  EXPECT_NEAR(fit.albedo.r, albedo.r, tolerance);
  EXPECT_NEAR(fit.albedo.g, albedo.g, tolerance);
  EXPECT_NEAR(fit.albedo.b, albedo.b, tolerance);
}

TEST(LambertFit, IsExactWithoutNoise) {
  Random random(1);
  for (int i = 0; i < 300; ++i) {
    const auto lights = ring(3 + i % 10, uniform(random, 0.2, 0.8));
    const auto n = nearZ(random, 0.6);
    const Rgb albedo = randomAlbedo(random);
    const LambertFit fit = fitLambert(lights, shares(n, albedo, lights));
    expectFit(fit, n, albedo, 2e-6);
    EXPECT_LT(fit.residual, 1e-6);
  }
}

TEST(LambertFit, LightsBehindTheSurfaceSayNoMoreThanThat) {
  Random random(2);
  size_t shaded = 0;
  for (int i = 0; i < 300; ++i) {
    const auto lights = ring(12, 1.0);
    const auto n = nearZ(random, 1.1);
    const Rgb albedo = randomAlbedo(random);
    shaded +=
        static_cast<size_t>(std::ranges::count_if(lights, [&](const auto& l) { return n.dot(l) <= 0; }));
    expectFit(fitLambert(lights, shares(n, albedo, lights)), n, albedo, 2e-6);
  }
  EXPECT_GT(shaded, 300u);
}

TEST(LambertFit, ShadowsAndHighlightsAreLeftOut) {
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const auto lights = ring(10, 0.7);
    const auto n = nearZ(random, 0.5);
    const Rgb albedo = randomAlbedo(random);
    auto y = shares(n, albedo, lights);
    const size_t first = static_cast<size_t>(i) % 10;
    y[first] = {};                                    // a cast shadow
    y[(first + 1) % 10] = 0.2f * y[(first + 1) % 10]; // a penumbra
    y[(first + 5) % 10] = y[(first + 5) % 10] + Rgb{0.8f, 0.8f, 0.8f};
    expectFit(fitLambert(lights, y), n, albedo, 1e-5);
  }
}

// Least squares has the covariance sigma^2 (L^T L)^-1 of b = rho n, and no unbiased fit a smaller one.
TEST(LambertFit, NoiseIsAveragedAlmostAsWellAsByLeastSquares) {
  Random random(4);
  constexpr double sigma = 0.004, albedo = 0.6;
  const auto lights = ring(12, 0.6);
  Mat3<double> information = Mat3<double>::Zero();
  for (const auto& l : lights) information += l * l.transpose();
  const double variance = sigma * sigma * information.inverse().trace();
  double squares = 0;
  constexpr int pixels = 2000;
  std::normal_distribution<double> noise(0, sigma);
  for (int i = 0; i < pixels; ++i) {
    const auto n = nearZ(random, 0.5);
    std::vector<Rgb> y;
    for (const auto& l : lights) {
      const auto value = static_cast<float>(albedo * n.dot(l) + noise(random));
      y.push_back({value, value, value});
    }
    const LambertFit fit = fitLambert(lights, y);
    squares += (static_cast<double>(fit.albedo.r) * fit.normal - albedo * n).squaredNorm();
  }
  EXPECT_LT(squares / pixels, 1.25 * variance);
  EXPECT_GT(squares / pixels, 0.9 * variance);
}

TEST(LambertFit, TurnsWithItsLights) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    auto lights = ring(8, 0.7);
    auto y = shares(nearZ(random, 0.5), randomAlbedo(random), lights);
    for (Rgb& share : y) share = static_cast<float>(uniform(random, 0.7, 1.3)) * share;
    const LambertFit fit = fitLambert(lights, y);
    const Mat3<double> turn = Eigen::AngleAxisd(uniform(random, 0, 3), nearZ(random, 3.1)).toRotationMatrix();
    for (auto& l : lights) l = turn * l;
    expectFit(fitLambert(lights, y), turn * fit.normal, fit.albedo, 1e-9);
  }
}

TEST(LambertFit, NothingIsKnownOfABlackPixelOrFromTwoLights) {
  const auto lights = ring(5, 0.5);
  EXPECT_TRUE(fitLambert(lights, std::vector<Rgb>(5)).normal.isZero());
  const auto two = ring(2, 0.5);
  EXPECT_TRUE(fitLambert(two, shares({0, 0, 1}, {1, 1, 1}, two)).normal.isZero());
  EXPECT_TRUE(fitLambert({}, {}).normal.isZero());
}

// A pinhole camera 5 units before a unit sphere at the origin, or a frontal plane.
capture::Camera<AcquisitionSpace> testCamera() {
  capture::Camera<AcquisitionSpace> camera;
  camera.lens = {capture::Lens::Model::pinhole, 24, 20, 60, 60, 12, 10, 0, 0, 0, 0};
  const Mat3<double> turn = Eigen::AngleAxisd(0.7, Vec3<double>(1, 2, -1).normalized()).toRotationMatrix();
  camera.cameraFromWorld = {turn, {0, 0, -5}};
  return camera;
}

capture::Light directional(const Vec3<double>& towards, float strength) {
  return {"", "",
          capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards),
                                    {strength, 2 * strength, 0.5f * strength}}};
}

// Lights of different strengths, on the camera's side.
std::vector<capture::Light> testLights(const capture::Camera<AcquisitionSpace>& camera) {
  std::vector<capture::Light> lights;
  for (const Vec3<double>& inCamera : ring(7, 0.5))
    lights.push_back(directional(camera.cameraFromWorld.rotation().transpose() * inCamera,
                                 static_cast<float>(1 + lights.size() % 3)));
  return lights;
}

image::Mask everywhere(const capture::Camera<AcquisitionSpace>& camera) {
  image::Mask mask(camera.lens.width, camera.lens.height);
  std::ranges::fill(mask.inside, uint8_t{1});
  return mask;
}

TEST(LambertImage, PhotographsOfASphereGiveItsNormalsAndComeBack) {
  const auto camera = testCamera();
  const auto lights = testLights(camera);
  image::Mask mask(24, 20);
  image::Image truth(24, 20, 3);
  std::vector<image::Image> radiance(lights.size(), image::Image(24, 20, 3));
  const Rgb albedo{0.3f, 0.5f, 0.7f};
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 24; ++x) {
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      const Vec3<double> o = worldFromCamera(ray->origin).raw(), d = worldFromCamera(ray->direction).raw();
      const double b = o.dot(d), discriminant = b * b - o.squaredNorm() + 1;
      if (discriminant < 0.2) continue; // all lights reach the rest
      const Vec3<double> n = o + (-b - std::sqrt(discriminant)) * d;
      mask.inside[static_cast<size_t>(y * 24 + x)] = 1;
      for (Eigen::Index c = 0; c < 3; ++c) truth.at(x, y)[static_cast<size_t>(c)] = static_cast<float>(n[c]);
      for (size_t i = 0; i < lights.size(); ++i) {
        const auto& light = std::get<capture::DirectionalLight>(lights[i].kind);
        const Rgb value = lambertRadiance({n, albedo, 0}, light.towards.raw(), light.irradiance);
        std::ranges::copy(std::array{value.r, value.g, value.b}, radiance[i].at(x, y).begin());
      }
    }
  const LambertImage fits = fitLambert(camera, lights, radiance, mask, {});
  EXPECT_GT(std::ranges::count(mask.inside, 1), 100);
  for (size_t i = 0; i < truth.values.size(); ++i) EXPECT_NEAR(fits.normal.values[i], truth.values[i], 1e-5);
  for (size_t i = 0; i < lights.size(); ++i) {
    const image::Image again = relit(fits, camera, lights[i]);
    for (size_t v = 0; v < again.values.size(); ++v)
      EXPECT_NEAR(again.values[v], radiance[i].values[v], 1e-5);
  }
}

TEST(LambertImage, PointLightsActAtTheFrontalPlane) {
  const auto camera = testCamera();
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const Vec3<double> n = worldFromCamera(Direction3<CameraSpace, double>(0, 0, 1)).raw();
  std::vector<capture::Light> lights;
  for (const Vec3<double>& l : ring(6, 0.6))
    lights.push_back(
        {"", "",
         capture::PointLight{worldFromCamera(Point3<CameraSpace, double>(3 * l[0], 3 * l[1], 3 * l[2] - 5)),
                             {4, 5, 6}}});
  std::vector<image::Image> radiance(lights.size(), image::Image(24, 20, 3));
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 24; ++x) {
      // The plane through the origin at right angles to the viewing axis.
      const Point3<CameraSpace, double> seen(5 * (x + 0.5 - 12) / 60, -5 * (y + 0.5 - 10) / 60, -5);
      const auto p = worldFromCamera(seen);
      for (size_t i = 0; i < lights.size(); ++i) {
        const Rgb value =
            lambertRadiance({n, {0.5f, 0.5f, 0.5f}, 0}, capture::towardsLight(lights[i], p).raw(),
                            capture::irradianceAt(lights[i], p));
        std::ranges::copy(std::array{value.r, value.g, value.b}, radiance[i].at(x, y).begin());
      }
    }
  const LambertImage fits = fitLambert(camera, lights, radiance, everywhere(camera), {});
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 24; ++x) expectFit(fits.at(x, y), n, {0.5f, 0.5f, 0.5f}, 1e-5);
}

TEST(LambertImage, LightsThatTellNoNormalAreRefused) {
  const auto camera = testCamera();
  const auto expectRefusal = [&](const std::vector<capture::Light>& lights, const std::string& found) {
    const std::vector<image::Image> radiance(lights.size(), image::Image(24, 20, 3));
    try {
      fitLambert(camera, lights, radiance, everywhere(camera), {});
      ADD_FAILURE() << "not refused: " << found;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(found), std::string::npos) << error.what();
    }
  };
  auto lights = testLights(camera);
  expectRefusal({lights[0], lights[1]}, "found 2");
  expectRefusal({}, "found 0");
  std::vector<capture::Light> inPlane;
  for (int i = 0; i < 6; ++i) inPlane.push_back(directional({std::sin(0.2 * i), 0, std::cos(0.2 * i)}, 1));
  expectRefusal(inPlane, "in a plane");
}

TEST(LambertImage, Cancels) {
  const auto camera = testCamera();
  const auto lights = testLights(camera);
  const std::vector<image::Image> radiance(lights.size(), image::Image(24, 20, 3));
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(fitLambert(camera, lights, radiance, everywhere(camera), progress), Cancelled);
}

} // namespace
} // namespace surflect::relief
