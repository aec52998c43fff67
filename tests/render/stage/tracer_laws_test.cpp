// Laws of light transport: conservation of energy, form factors, and equal results by different methods.
#include "render/stage/material/fresnel.h"
#include "render/stage/tracer.h"
#include "tests/render/stage/material/zoo.h"
#include "tests/render/stage/walk.h"

#include <gtest/gtest.h>

namespace surflect::stage {
namespace {

constexpr StagePoint kOrigin{0, 0, 0};

TraceOptions tracing(Transport transport, int samples, double radiusDeg = 0, uint64_t seed = 1) {
  TraceOptions options;
  options.transport = transport;
  options.samples = samples;
  options.lightRadius = Angle::fromDegrees(radiusDeg);
  options.seed = seed;
  return options;
}

// Over all samples that meet something; red.
double meanOf(const TracedView& view, size_t light) {
  double total = 0;
  for (size_t i = 0; i < view.alpha.values.size(); ++i)
    total += double{view.alpha.values[i]} * view.radiance[light].values[3 * i];
  return total / sum(view.alpha);
}

// By seeds, which are independent.
Estimate traced(const StageScene& scene, const capture::Camera<AcquisitionSpace>& camera,
                const capture::Light& light, TraceOptions options, int seeds) {
  return estimateOf(seeds, [&] {
    ++options.seed;
    return meanOf(traceView(scene, camera, 0, std::span(&light, 1), options, {}), 0);
  });
}

// Radiance 1 in a disc.
capture::Light disc(const StageDirection& towards, double radiusDeg) {
  const auto irradiance = static_cast<float>(
      material::kPi * material::squared(std::sin(Angle::fromDegrees(radiusDeg).radians())));
  return sun(towards, {irradiance, irradiance, irradiance});
}

// Two hemispheres of light of radiance 1 are a white room.
TEST(TracerLaws, WhiteThingsVanishInAWhiteRoom) {
  constexpr double kHemisphere = 89.9999;
  const std::vector<capture::Light> room{disc(unit(0, 0, 1), kHemisphere), disc(unit(0, 0, -1), kHemisphere)};
  const capture::Camera camera = setPlaces(unit(1, 0.4, 0.5), 5, 12, 30);
  const std::vector<material::zoo::Named> white = {
      {"lambert", material::Lambert{{1, 1, 1}}},
      {"mirror", material::Conductor{{1, 1, 1}, {1, 1, 1}, {0, 0}}},
      {"metal 0.02", material::zoo::conductor(0.02, 0.02)},
      {"metal 0.3", material::zoo::conductor(0.3, 0.3)},
      {"metal 1", material::zoo::conductor(1, 1)},
      {"brushed", material::zoo::conductor(0.1, 0.5)},
      {"clear glass", material::Dielectric{}},
      {"rough glass", material::zoo::glass(0.3)}};
  for (const auto& [name, material] : white) {
    std::vector<StageObject> objects = oneObject(sphere({-0.4, 0, 0}, 0.6, 96), material);
    objects.push_back({sphere({0.7, 0, 0.2}, 0.5, 96), material});
    // Light leaves rough glass by chance only: one sample's standard deviation is about 1.
    const bool isRoughGlass = name == "rough glass";
    const TracedView view = traceView(StageScene(objects), camera, 0, room,
                                      tracing(Transport::full, isRoughGlass ? 2000 : 400, kHemisphere), {});
    EXPECT_NEAR(meanOf(view, 0) + meanOf(view, 1), 1, isRoughGlass ? 0.01 : 0.005) << name;
  }
}

// Unit squares one above the other at distance 1: F = 0.199825 [Howell 1982, C-11]. Light at 45 degrees
// reaches all of the lower one beneath the upper, which is seen from below at 45 degrees.
TEST(TracerLaws, ParallelPlatesExchangeTheirFormFactor) {
  const float floorAlbedo = 0.5f, ceilingAlbedo = 1e-3f; // which sends nothing back
  std::vector<StageObject> objects = oneObject(quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}),
                                               material::Lambert{{floorAlbedo, floorAlbedo, floorAlbedo}});
  objects.push_back({quad({0, 0, 1}, {0, 1, 0}, {1, 0, 0}),
                     material::Lambert{{ceilingAlbedo, ceilingAlbedo, ceilingAlbedo}}});
  const std::vector<capture::Light> lights{sun(unit(1, 0, 1 - 1e-9), {1, 1, 1})};
  const double pixelsAUnit = 24;
  const capture::Camera camera =
      setPlaces(unit(-1, 0, -1), 5, 64, pixelsAUnit, capture::Lens::Model::orthographic);
  const TracedView full =
      traceView(StageScene(objects), camera, 0, lights, tracing(Transport::full, 1024), {});
  double total = 0;
  for (size_t i = 0; i < full.alpha.values.size(); ++i)
    total += double{full.alpha.values[i]} * full.radiance[0].values[3 * i];
  const double pixels = material::squared(pixelsAUnit) * std::sqrt(0.5), E = std::sqrt(0.5);
  const double expected = ceilingAlbedo / material::kPi * 0.199825 * floorAlbedo * E;
  EXPECT_NEAR(total / pixels, expected, 0.01 * expected);
  const TracedView direct =
      traceView(StageScene(objects), camera, 0, lights, tracing(Transport::direct, 16), {});
  EXPECT_EQ(sum(direct.radiance[0]), 0);
}

TEST(TracerLaws, DirectLightIsAllThereIsOnAConvexObject) {
  std::mt19937 random(2);
  const StageScene scene(oneObject(box(kOrigin, {1, 2, 1.5}, 3), material::Lambert{kAlbedo}));
  const std::vector<capture::Light> lights{sun(randomDirection(random)),
                                           sun(randomDirection(random)),
                                           {"bulb", "bulb", capture::PointLight{{3, 1, 2}, {9, 8, 7}}}};
  for (const double radius : {0.0, 5.0}) {
    const capture::Camera camera = setPlaces(randomDirection(random), 5, 24, 30);
    const auto full = traceView(scene, camera, 0, lights, tracing(Transport::full, 4, radius), {}),
               direct = traceView(scene, camera, 0, lights, tracing(Transport::direct, 4, radius), {});
    for (size_t i = 0; i < lights.size(); ++i)
      EXPECT_EQ(full.radiance[i].values, direct.radiance[i].values) << i;
  }
}

// At each pixel of a hollow, and by much in all: sum_k rho^k is 1 / (1 - rho) in an integrating sphere.
TEST(TracerLaws, DirectLightIsLessThanAllInAHollow) {
  const float rho = 0.75f;
  const StageScene scene(oneObject(sphere(kOrigin, 2, 128), material::Lambert{{rho, rho, rho}}));
  const std::vector<capture::Light> lamp{{"lamp", "lamp", capture::PointLight{kOrigin, {4, 4, 4}}}};
  const capture::Camera camera = setPlaces(unit(1, 1, 0.3), 0.5, 12, 10);
  const auto direct = traceView(scene, camera, 0, lamp, tracing(Transport::direct, 64), {}),
             full = traceView(scene, camera, 0, lamp, tracing(Transport::full, 64), {});
  EXPECT_NEAR(meanOf(direct, 0), rho / material::kPi, 0.01 * rho / material::kPi);
  EXPECT_NEAR(meanOf(full, 0), rho / material::kPi / (1 - rho), 0.01 * rho / material::kPi / (1 - rho));
  for (size_t i = 0; i < direct.radiance[0].values.size(); ++i)
    EXPECT_LT(direct.radiance[0].values[i], full.radiance[0].values[i]);
}

// A ball between a floor and the light, in each of the things that shade or bend light.
TEST(TracerLaws, OneAnswerWhetherLightsAreAskedOrFoundByChance) {
  constexpr double kRadius = 25;
  const StageDirection towards = unit(0.3, -0.4, 1);
  const Rgb red{0.9f, 0.3f, 0.1f};
  const std::vector<material::zoo::Named> balls = {
      {"lambert", material::Lambert{red}},
      {"metal 0.02", material::zoo::conductor(0.02, 0.02, red)},
      {"brushed", material::zoo::conductor(0.1, 0.5, red)},
      {"clear glass", material::Dielectric{1.5, 0, {0.5f, 0, 0}}},
      {"frosted glass", material::Dielectric{1.5, 0.05, {0.5f, 0, 0}, &material::zoo::glassLosses()}},
      {"rough glass", material::zoo::glass(0.5)},
      {"varnish", material::zoo::coat(0, material::Lambert{red})},
      {"plastic", material::zoo::coat(0.1, material::Lambert{red})}};
  const auto environment = [&](const StageDirection& d) {
    return std::acos(std::clamp(dot(d, towards), -1., 1.)) < Angle::fromDegrees(kRadius).radians() ? 1. : 0.;
  };
  const capture::Camera camera = setPlaces(unit(1, 0.2, 0.6), 5, 8, 16);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0, 8);
  const auto fromCamera = camera.cameraFromWorld.inverse();
  for (const auto& [name, material] : balls) {
    std::vector<StageObject> objects = oneObject(sphere({0, 0, 0.2}, 0.7, 128), material);
    objects.push_back({box({0, 0, -1}, {60, 60, 0.5}, 1), material::Lambert{{0.6f, 0.6f, 0.6f}}});
    const StageScene scene(objects);
    const Estimate fast =
        traced(scene, camera, disc(towards, kRadius), tracing(Transport::full, 16, kRadius), 32);
    const Estimate slow = estimateOf(40000, [&] {
      const double x = uniform(random), y = uniform(random);
      const auto ray = capture::rayThrough(camera.lens, {x, y});
      return walk(scene, fromCamera(ray->origin), fromCamera(ray->direction), environment, random);
    });
    EXPECT_NEAR(fast.mean, slow.mean, 3.5 * std::hypot(fast.error, slow.error)) << name;
    EXPECT_LT(slow.error, 0.02 * slow.mean) << name; // the comparison says something
  }
}

// f cos over the disc, against a plane; by a fine rule.
double reflectedByRule(const material::Material& material, const material::ShadingDirection& wo,
                       const material::ShadingDirection& middle, double radiusDeg) {
  const Vec3<double> z = middle.raw(), x = z.unitOrthogonal(), y = z.cross(x);
  const double height = 1 - std::cos(Angle::fromDegrees(radiusDeg).radians());
  constexpr int kRings = 1000, kSpokes = 200; // finer towards the middle
  double total = 0;
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kSpokes; ++j) {
      const double t = (i + 0.5) / kRings, c = 1 - height * t * t, s = std::sqrt(1 - c * c);
      const double phi = 2 * material::kPi * (j + 0.5) / kSpokes;
      const Vec3<double> w = c * z + s * std::cos(phi) * x + s * std::sin(phi) * y;
      total += 2 * t * double{material::evaluate(material, {w[0], w[1], w[2]}, wo).r};
    }
  return total * 2 * material::kPi * height / (kRings * kSpokes);
}

// Light found both ways, from almost a mirror to rough, beside the integral; and neither way makes noise
// where the other would be sure.
TEST(TracerLaws, LightsOfAnExtentOnAPlaneAreTheIntegral) {
  const StageDirection viewer = unit(1, 0, 1);
  const capture::Camera camera = setPlaces(viewer, 5, 1, 1e6);
  for (const double radius : {1.0, 10.0})
    for (const double alpha : {0.002, 0.02, 0.1, 0.5})
      for (const double aside : {0.0, 0.1}) {
        const material::Material metal = material::zoo::conductor(alpha, alpha);
        const StageScene scene(oneObject(box({0, 0, -0.5}, {40, 40, 1}, 1), metal));
        const StageDirection towards = unit(-1, aside, 1);
        const auto local = [](const StageDirection& d) {
          return material::ShadingDirection(d.x(), d.y(), d.z());
        };
        const double expected = reflectedByRule(metal, local(viewer), local(towards), radius);
        for (const Transport transport : {Transport::local, Transport::direct, Transport::full}) {
          const Estimate got =
              traced(scene, camera, disc(towards, radius), tracing(transport, 256, radius), 16);
          EXPECT_NEAR(got.mean, expected, 4 * got.error + 1e-4 * expected)
              << alpha << ' ' << radius << ' ' << aside;
          // Error of a picture with 16 samples per pixel.
          EXPECT_LT(got.error * 16, 0.6 * got.mean + 0.02) << alpha << ' ' << radius << ' ' << aside;
        }
      }
}

} // namespace
} // namespace surflect::stage
