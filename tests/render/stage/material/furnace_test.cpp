// White furnace: in a white room a surface without absorption is invisible.
#include "render/stage/material/material.h"
#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

constexpr double kManyCosines[] = {1, 0.9, 0.6, 0.3, 0.1, 0.03, 0.01, 0.002};
constexpr double alphas[] = {0.002, 0.015, 0.05, 0.1, 0.17, 0.3, 0.5, 0.72, 1};

void expectWhite(const Material& material, const ShadingDirection& wo, const std::string& what) {
  const Rgb reflected = albedo(material, wo, 1 << 14);
  EXPECT_NEAR(reflected.r, 1, 0.005) << what << " mu " << wo.z();
  EXPECT_EQ(reflected.r, reflected.b);
}

TEST(WhiteFurnace, Diffuse) {
  for (const double mu : kManyCosines) {
    EXPECT_NEAR(albedo(Lambert{{1, 1, 1}}, zoo::at(mu, 1)).g, 1, 1e-6);
    for (const double roughness : {0.0, 0.3, 1.0})
      expectWhite(RoughDiffuse{{1, 1, 1}, roughness}, zoo::at(mu, 1), "rough diffuse");
  }
}

TEST(WhiteFurnace, Conductors) {
  for (const double alpha : alphas)
    for (const double mu : kManyCosines)
      expectWhite(zoo::conductor(alpha, alpha), zoo::at(mu, 1), "alpha " + std::to_string(alpha));
}

TEST(WhiteFurnace, BrushedConductors) {
  for (const auto& [x, y] : {std::pair{0.05, 0.3}, {0.1, 1.0}, {0.05, 1.0}, {0.6, 0.4}, {1.0, 0.2}})
    for (const double mu : {1.0, 0.6, 0.1, 0.01})
      for (const double azimuth : {0.0, 0.4, 1.2, kPi / 2})
        expectWhite(zoo::conductor(x, y), zoo::at(mu, azimuth),
                    "alpha " + std::to_string(x) + ' ' + std::to_string(y) + " azimuth " +
                        std::to_string(azimuth));
}

TEST(WhiteFurnace, GlassFromOutsideAndInside) {
  for (const double alpha : alphas)
    for (const double mu : kManyCosines)
      for (const double side : {1.0, -1.0})
        expectWhite(zoo::glass(alpha), zoo::at(side * mu, 1), "alpha " + std::to_string(alpha));
}

TEST(WhiteFurnace, VarnishOnWhite) {
  for (const double alpha : {0.0, 0.05, 0.3, 1.0})
    for (const double mu : kManyCosines)
      expectWhite(zoo::coat(alpha, Lambert{{1, 1, 1}}), zoo::at(mu, 1), "alpha " + std::to_string(alpha));
}

TEST(WhiteFurnace, NothingElseGainsMoreThanItsTables) {
  const Conductor mirror{}, brushed{{1, 1, 1}, {1, 1, 1}, {0.1, 0.4}, &zoo::mirrorLoss()};
  Conductor smooth = mirror;
  smooth.alpha = {0, 0};
  const RoughDiffuse rough{{1, 1, 1}, 1};
  const Ward ward{{0, 0, 0}, {1, 1, 1}, {0.2, 0.2}};
  for (const double mu : kManyCosines)
    for (const double alpha : {0.0, 0.05, 0.3, 1.0})
      for (const CoatBase& base : {CoatBase(smooth), CoatBase(brushed), CoatBase(rough), CoatBase(ward)})
        EXPECT_LT(albedo(zoo::coat(alpha, base), zoo::at(mu, 1), 1 << 13).r, 1.005)
            << mu << ' ' << alpha << ' ' << base.index();
}

} // namespace
} // namespace surflect::material
