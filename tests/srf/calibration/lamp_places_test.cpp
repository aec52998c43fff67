#include "srf/calibration/lamp_places.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <numbers>
#include <random>

namespace surflect::calibration {
namespace {

// Points of a Lambert ellipsoid with semi-axes 1, 0.8 and 0.6, each with its own albedo, from cameras around
// it at a distance of 5.
struct Studio {
  explicit Studio(int cameras, unsigned seed = 7) : random(seed) {
    std::uniform_real_distribution<double> albedo(0.1, 0.9);
    const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
    const Vec3<double> axes(1, 0.8, 0.6);
    for (int i = 0; i < 400; ++i) {
      const double z = 1 - (2 * i + 1.0) / 400, r = std::sqrt(1 - z * z);
      const Vec3<double> on(r * std::cos(golden * i), r * std::sin(golden * i), z);
      surface.points.push_back(axes.cwiseProduct(on));
      normals.push_back(on.cwiseQuotient(axes).normalized());
      albedos.push_back(albedo(random));
    }
    for (int c = 0; c < cameras; ++c) {
      const double z = 0.9 - 1.8 * (c + 0.5) / cameras, r = std::sqrt(1 - z * z);
      const Vec3<double> back(r * std::cos(golden * c), r * std::sin(golden * c), z);
      Mat3<double> turn;
      turn.col(0) = Vec3<double>(0, 0, 1).cross(back).normalized();
      turn.col(1) = back.cross(turn.col(0));
      turn.col(2) = back;
      turns.push_back(turn);
      eyes.push_back(5 * back);
    }
  }
  // Photographs of all cameras by a lamp at a place of the world, or of the cameras' axes.
  void photograph(size_t lamp, const Vec3<double>& place, bool isCarried, double strength = 1,
                  double noise = 0) {
    std::normal_distribution<double> error(0, noise);
    for (size_t c = 0; c < eyes.size(); ++c) {
      LampPhotograph photograph{.lamp = lamp, .eye = eyes[c]};
      if (isCarried) photograph.turn = turns[c], photograph.shift = eyes[c];
      const Vec3<double> x = photograph.turn * place + photograph.shift;
      for (size_t i = 0; i < surface.points.size(); ++i) {
        const Vec3<double> d = x - surface.points[i];
        if (!(normals[i].dot(eyes[c] - surface.points[i]) > 0) || !(normals[i].dot(d) > 0)) continue;
        const double b = strength * albedos[i] * normals[i].dot(d) / std::pow(d.norm(), 3);
        surface.shades.push_back({static_cast<uint32_t>(i), static_cast<uint32_t>(surface.photographs.size()),
                                  static_cast<float>(b * std::exp(noise > 0 ? error(random) : 0)),
                                  normals[i].cast<float>()});
      }
      surface.photographs.push_back(photograph);
    }
  }

  std::mt19937 random;
  ShadedSurface surface;
  std::vector<Vec3<double>> normals, eyes;
  std::vector<Mat3<double>> turns;
  std::vector<double> albedos;
};

TEST(LampPlaces, OfAFlashAreExactOnALambertSurface) {
  const Vec3<double> camera(0, 0, 0);
  for (const Vec3<double>& flash :
       {Vec3<double>(0, 0, 0), Vec3<double>(0.3, 0.4, -0.2), Vec3<double>(-1, 0.5, 1)}) {
    Studio studio(12);
    studio.photograph(0, flash, true);
    const LampPlace found = lampPlaces(studio.surface, std::span(&camera, 1))[0];
    EXPECT_LT((found.place - flash).norm(), 5.4e-8) << flash.transpose(); // luminances are floats
    EXPECT_LT(found.standardErrors.norm(), 7e-8);
  }
}

TEST(LampPlaces, OfAFlashAreWithinTheirStandardErrorsUnderNoise) {
  const Vec3<double> camera(0, 0, 0), flash(0.3, 0.4, -0.2);
  // Mean square of the coordinates' errors over their standard errors by eight parts: 7 / 5 by Student's
  // distribution with seven degrees of freedom, were the parts alike; found 2.6.
  double squares = 0;
  constexpr unsigned kStudios = 20;
  for (unsigned seed = 0; seed < kStudios; ++seed) {
    Studio studio(12, seed);
    studio.photograph(0, flash, true, 1, 0.05);
    const LampPlace found = lampPlaces(studio.surface, std::span(&camera, 1))[0];
    EXPECT_LT(found.standardErrors.norm(), 0.09);
    squares += (found.place - flash).cwiseQuotient(found.standardErrors).squaredNorm() / (3 * kStudios);
  }
  EXPECT_LT(squares, 3);
  EXPECT_GT(squares, 0.5);
}

TEST(LampPlaces, StopWhenAskedTo) {
  const Vec3<double> camera(0, 0, 0);
  Studio studio(12);
  studio.photograph(0, {0.3, 0.4, -0.2}, true);
  int asked = 0;
  EXPECT_THROW(lampPlaces(studio.surface, std::span(&camera, 1), {{}, [&] { return ++asked > 3; }}),
               Cancelled);
  EXPECT_EQ(asked, 4);
}

TEST(LampPlaces, AreNotMovedByHighlightsAndShadows) {
  const Vec3<double> camera(0, 0, 0), flash(0.3, 0.4, -0.2);
  Studio studio(12);
  studio.photograph(0, flash, true);
  for (size_t s = 0; s < studio.surface.shades.size(); s += 10) // in a tenth of the surface
    studio.surface.shades[s].luminance *= s % 20 == 0 ? 3.f : 0.3f;
  const LampPlace found = lampPlaces(studio.surface, std::span(&camera, 1))[0];
  EXPECT_LT((found.place - flash).norm(), 1e-7);
}

TEST(LampPlaces, OfLampsInTheWorldComeWithTheirStrengths) {
  Studio studio(6);
  std::vector<Vec3<double>> places;
  std::vector<double> strengths;
  for (int l = 0; l < 6; ++l) {
    places.push_back((3 + 0.4 * l) *
                     Vec3<double>(std::cos(l), std::sin(l), 0.4 * (l % 3) - 0.3).normalized());
    strengths.push_back(1 + 0.3 * (l % 2));
    studio.photograph(static_cast<size_t>(l), places.back(), false, strengths.back());
  }
  const auto guesses = guessedPlaces(studio.surface, places.size(), 5);
  for (size_t l = 0; l < places.size(); ++l)
    EXPECT_GT(guesses[l].normalized().dot(places[l].normalized()), 0.91) << l;
  const auto found = lampPlaces(studio.surface, guesses);
  for (size_t l = 0; l < places.size(); ++l) {
    EXPECT_LT((found[l].place - places[l]).norm(), 3e-7) << l;
    EXPECT_NEAR(found[l].strength / found[0].strength, strengths[l] / strengths[0], 2.9e-7);
  }
}

TEST(LampPlaces, OfADimLampThatIsFarAwayHaveALargeErrorOfTheirDistance) {
  Studio studio(6);
  for (int l = 0; l < 4; ++l)
    studio.photograph(static_cast<size_t>(l),
                      (l == 0 ? 300.0 : 4) * Vec3<double>(std::cos(l), std::sin(l), 0.3).normalized(), false,
                      1, 0.05);
  const auto found = lampPlaces(studio.surface, guessedPlaces(studio.surface, 4, 5));
  EXPECT_GT(found[0].errorOfDistance, 0.25);
  EXPECT_GT(found[0].place.normalized().dot(Vec3<double>(1, 0, 0.3).normalized()), 0.9995);
  for (size_t l = 1; l < 4; ++l) EXPECT_LT(found[l].errorOfDistance, 0.08);
}

TEST(LampPlaces, NeedPointsInTwoPhotographs) {
  const Vec3<double> camera(0, 0, 0);
  Studio studio(1);
  studio.photograph(0, {0.1, 0.2, 0}, true);
  try {
    lampPlaces(studio.surface, std::span(&camera, 1));
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "found 0, expected at least 50 points of the mesh, lit and in two photographs or more");
  }
}

} // namespace
} // namespace surflect::calibration
