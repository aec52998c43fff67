// Interfaces between air, glass and media in the glass, against closed forms.
//
// Symbols: R and T share of radiance (over n^2) that a layer reflects and transmits, r that of an interface,
// t transmittance of one passage through a layer.
#include "render/stage/material/fresnel.h"
#include "render/stage/tracer.h"
#include "tests/render/stage/material/zoo.h"
#include "tests/render/stage/stages.h"

#include <gtest/gtest.h>

namespace surflect::stage {
namespace {

constexpr double kGlass = 1.5, kWater = 1.33, kRadiusDeg = 1;

// At height z, large; facing up or down.
Surface plane(double z, bool isUp) {
  return isUp ? quad({-50, -50, z}, {100, 0, 0}, {0, 100, 0}) : quad({-50, -50, z}, {0, 100, 0}, {100, 0, 0});
}

TraceOptions discs(int samples, double radiusDeg) {
  TraceOptions options;
  options.samples = samples;
  options.lightRadius = Angle::fromDegrees(radiusDeg);
  return options;
}

// Radiance that a distant viewer in direction `from` sees of a disc of radiance 1 in direction `towards`.
double seen(const StageScene& scene, const StageDirection& from, const StageDirection& towards, int samples,
            double radiusDeg = kRadiusDeg) {
  const TraceOptions options = discs(samples, radiusDeg);
  const auto E =
      static_cast<float>(material::kPi * material::squared(std::sin(options.lightRadius.radians())));
  capture::Camera<AcquisitionSpace> camera = setPlaces(from, 5, 1, 1000, capture::Lens::Model::orthographic);
  return traceView(scene, camera, 0, std::vector{sun(towards, {E, E, E})}, options, {}).radiance[0].values[0];
}

// Reflectance and transmittance for light from above, and from below.
struct Layer {
  double Rabove, Rbelow, T;
};

// All ways of going to and fro between them.
Layer stacked(const Layer& above, const Layer& below) {
  const double series = 1 / (1 - above.Rbelow * below.Rabove);
  return {above.Rabove + material::squared(above.T) * below.Rabove * series,
          below.Rbelow + material::squared(below.T) * above.Rbelow * series, above.T * below.T * series};
}

Layer interface(double mu, double eta) {
  const double r = material::dielectricFresnel(mu, eta);
  return {r, r, 1 - r};
}

Layer absorbing(double sigma, double thickness, double mu) {
  return {0, 0, std::exp(-sigma * thickness / mu)};
}

// Water of depth 0.7 on glass of thickness 0.4 over air. The interface below the water says what lies on its
// other side, whichever way it faces.
TEST(TracerGlass, WaterOnGlassPassesWhatFresnelAndBeerSay) {
  const float inWater = 0.6f, inGlass = 1.1f;
  const Rgb water{inWater, inWater, inWater}, glass{inGlass, inGlass, inGlass};
  const StageObject surface{plane(0.7, true), material::Dielectric{kWater, 0, water}};
  const StageObject outOfWater{plane(0, false),
                               material::Dielectric{kWater / kGlass, 0, water, nullptr, glass}};
  const StageObject outOfGlass{plane(0, true),
                               material::Dielectric{kGlass / kWater, 0, glass, nullptr, water}};
  const StageObject bottom{plane(-0.4, false), material::Dielectric{kGlass, 0, glass}};
  for (const StageObject& between : {outOfWater, outOfGlass})
    for (const double degrees : {1e-4, 40.0, 65.0}) {
      const double mu = std::cos(Angle::fromDegrees(degrees).radians());
      const double muWater = material::refractedCosine(mu, kWater),
                   muGlass = material::refractedCosine(mu, kGlass);
      const Layer all =
          stacked(stacked(stacked(interface(mu, kWater), absorbing(inWater, 0.7, muWater)),
                          stacked(interface(muWater, kGlass / kWater), absorbing(inGlass, 0.4, muGlass))),
                  interface(muGlass, 1 / kGlass));
      const double sine = std::sqrt(1 - mu * mu);
      const StageScene scene({surface, between, bottom});
      for (const bool isAbove : {true, false}) {
        const double z = isAbove ? mu : -mu;
        const StageDirection from(sine, 0, z), through(-sine, 0, -z), back(-sine, 0, z);
        EXPECT_NEAR(seen(scene, from, through, 40000), all.T, 0.01) << degrees << ' ' << isAbove;
        EXPECT_NEAR(seen(scene, from, back, 40000), isAbove ? all.Rabove : all.Rbelow, 0.01) << degrees;
      }
    }
}

// Through a right prism of legs of 1: in, reflected wholly at the long side (45 degrees are beyond the
// critical angle of 41.8), out; all ways through it have the length of 1.
TEST(TracerGlass, PrismsReflectTotally) {
  const material::Dielectric glass{kGlass, 0, {0.8f, 0.8f, 0.8f}};
  const double w = 1; // half of its width along y
  std::vector<StageObject> prism;
  prism.push_back({quad({0, -w, 1}, {0, 2 * w, 0}, {0, 0, -1}), glass}); // x = 0, facing -x
  prism.push_back({quad({0, -w, 0}, {0, 2 * w, 0}, {1, 0, 0}), glass});  // z = 0, facing down
  prism.push_back({quad({1, -w, 0}, {0, 2 * w, 0}, {-1, 0, 1}), glass}); // x + z = 1
  ASSERT_LT(prism[0].surface.normals[0].x(), 0);
  ASSERT_LT(prism[1].surface.normals[0].z(), 0);
  ASSERT_GT(prism[2].surface.normals[0].x(), 0);
  const StageScene scene(prism);
  capture::Camera<AcquisitionSpace> camera =
      setPlaces(unit(-1, 0, 0), 5, 1, 10, capture::Lens::Model::orthographic);
  camera.lens.centerY = 5.5; // the pixel lies at z = 0.5
  const double E = material::kPi * material::squared(std::sin(Angle::fromDegrees(kRadiusDeg).radians()));
  const auto e = static_cast<float>(E);
  const TracedView view = traceView(scene, camera, 0, std::vector{sun({0, 0, -1}, {e, e, e}), sun({1, 0, 0})},
                                    discs(20000, kRadiusDeg), {});
  const double r = 0.04, t = std::exp(-0.8);
  ASSERT_EQ(view.alpha.values[0], 1);
  EXPECT_NEAR(view.radiance[0].values[0], t * material::squared(1 - r) / (1 - material::squared(r * t)),
              0.01);
  EXPECT_EQ(view.radiance[1].values[0], 0);
}

// A white floor under water, of radiance that grows by n^2 on its way in and falls on its way out:
// T(wo) rho / (pi n^2 (1 - rho (1 - meanT / n^2))) int T(wi) cos dwi.
TEST(TracerGlass, FloorUnderWaterIsDimmerByTheSquareOfTheIndex) {
  constexpr double kWide = 40;
  for (const double rho : {0.5, 1.0}) {
    const auto albedo = static_cast<float>(rho);
    const StageScene scene({{plane(0, true), material::Dielectric{kWater, 0, {}}},
                            {plane(-0.2, true), material::Lambert{{albedo, albedo, albedo}}}});
    double integral = 0;
    constexpr int kSteps = 1000;
    const double lowest = std::cos(Angle::fromDegrees(kWide).radians());
    for (int i = 0; i < kSteps; ++i) {
      const double mu = lowest + (1 - lowest) * (i + 0.5) / kSteps;
      integral +=
          2 * material::kPi * (1 - material::dielectricFresnel(mu, kWater)) * mu * (1 - lowest) / kSteps;
    }
    const double n2 = kWater * kWater, meanT = 1 - material::meanDielectricFresnel(kWater);
    for (const double degrees : {1e-4, 60.0}) {
      const double mu = std::cos(Angle::fromDegrees(degrees).radians()), sine = std::sqrt(1 - mu * mu);
      const double T = 1 - material::dielectricFresnel(mu, kWater);
      const double expected = T * rho / (material::kPi * n2 * (1 - rho * (1 - meanT / n2))) * integral;
      // The disc's mirror image is aside, or is added.
      const double mirrored = degrees < kWide ? 1 - T : 0;
      EXPECT_NEAR(seen(scene, {sine, 0, mu}, {0, 0, 1}, 250000, kWide), expected + mirrored, 0.015 * expected)
          << degrees << ' ' << rho;
    }
  }
}

// Rough surface on the layer: without closed form, but energy is conserved, and a white floor makes
// everything white in a white room.
TEST(TracerGlass, RoughWaterOnWhiteLosesNothing) {
  constexpr double kHemisphere = 89.9999;
  const material::Dielectric rough{1.5, 0.3, {}, &material::zoo::glassLosses()};
  const StageScene scene({{plane(0, true), rough}, {plane(-0.2, true), material::Lambert{{1, 1, 1}}}});
  for (const double degrees : {10.0, 75.0}) {
    const double angle = Angle::fromDegrees(degrees).radians();
    EXPECT_NEAR(seen(scene, {std::sin(angle), 0, std::cos(angle)}, {0, 0, 1}, 20000, kHemisphere), 1, 0.01);
  }
}

// Alpha is what a plate keeps from a ray that is refracted at both of its sides; what is reflected inside
// first does not count as passed.
TEST(TracerGlass, TheMatteOfAPlateIsWhatItDoesNotTransmit) {
  const float sigma = 1.1f;
  const double thickness = 0.4;
  const material::Dielectric glass{kGlass, 0, {sigma, sigma, sigma}};
  const StageScene plate({{plane(0, true), glass}, {plane(-thickness, false), glass}});
  for (const double degrees : {1e-4, 40.0, 70.0}) {
    const Angle angle = Angle::fromDegrees(degrees);
    const double mu = std::cos(angle.radians());
    const Layer surface = interface(mu, kGlass),
                inside = absorbing(double{sigma}, thickness, material::refractedCosine(mu, kGlass));
    const auto camera =
        setPlaces({std::sin(angle.radians()), 0, mu}, 5, 1, 1000, capture::Lens::Model::orthographic);
    TraceOptions options;
    options.samples = 1 << 16;
    const std::vector lights{sun({0, 0, 1}, {1, 1, 1})};
    EXPECT_EQ(traceView(plate, camera, 0, lights, options, {}).alpha.values[0], 1);
    options.matte = Matte::transmittance;
    EXPECT_NEAR(traceView(plate, camera, 0, lights, options, {}).alpha.values[0],
                1 - material::squared(surface.T) * inside.T,
                5e-3) // 2^16 paths that pass or not deviate by up to 2e-3
        << degrees;
  }
}

TEST(TracerGlass, AnOpaqueSurfaceBehindGlassKeepsTheMatteWhole) {
  const material::Dielectric glass{kGlass};
  const StageScene covered({{plane(0, true), glass},
                            {plane(-0.4, false), glass},
                            {plane(-1, true), material::Lambert{{0.5f, 0.5f, 0.5f}}}});
  TraceOptions options;
  options.matte = Matte::transmittance;
  const auto camera = setPlaces({0.2, 0, 1}, 5, 1, 1000, capture::Lens::Model::orthographic);
  EXPECT_EQ(
      traceView(covered, camera, 0, std::vector{sun({0, 0, 1}, {1, 1, 1})}, options, {}).alpha.values[0], 1);
}

} // namespace
} // namespace surflect::stage
