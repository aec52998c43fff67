#include "render/surfels/prepared_environment.h"

#include "render/scene/scene.h"
#include "render/surfels/develop.h"
#include "render/surfels/frame.h"
#include "render/surfels/queries.h"
#include "srf/image/exr.h"
#include "srf/weights/ulr.h"
#include "tests/render/films.h"
#include "tests/srf/shading/queries.h"
#include "warp/deform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect::surfels {
namespace {

using scene::ShotDirectionalLight;
using scene::ShotEnvironment;
using scene::ShotLight;
using scene::ShotPointLight;

using studio::cameraFrom;
using studio::filmOf;
using studio::largestDifference;
using studio::noWarp;
using studio::PackedStudio;
using studio::pictureSize;
using studio::Studio;

double rootMeanSquare(const image::Image& a, const image::Image& b) {
  double sum = 0;
  for (size_t i = 0; i < a.values.size(); ++i) sum += std::pow(a.values[i] - b.values[i], 2);
  return std::sqrt(sum / static_cast<double>(a.values.size()));
}

using SharedMap = std::shared_ptr<const weights::EnvironmentMap>;

SharedMap mapOf(const image::Image& image) {
  return std::make_shared<const weights::EnvironmentMap>(
      weights::environmentOf(image, weights::EnvironmentMapping::latLong));
}

// A sky, a dark ground and two suns of different colour.
SharedMap liveliest(int height) {
  image::Image image(2 * height, height, 3);
  const auto sun = [](const Vec3<double>& d, const Vec3<double>& towards) {
    return std::exp(80 * (d.dot(towards.normalized()) - 1));
  };
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < 2 * height; ++x) {
      const Vec3<double> d = weights::latLongDirection((x + 0.5) / (2 * height), (y + 0.5) / height).raw();
      const double sky = 0.6 + 0.4 * d[1], warm = 30 * sun(d, {1, 1, -1}), cold = 20 * sun(d, {-2, 0.3, 0.5});
      const std::array rgb{sky + warm, sky + 0.5 * (warm + cold), 1.5 * sky + cold};
      for (size_t c = 0; c < 3; ++c) image.at(x, y)[c] = static_cast<float>(rgb[c]);
    }
  return mapOf(image);
}

std::vector<ShotLight> lightOf(const SharedMap& map,
                               const Mat3<double>& objectFromEnvironment = Mat3<double>::Identity(),
                               double error = 0.01) {
  return {
      ShotEnvironment{map, Rotation<ObjectSpace, EnvironmentSpace>(objectFromEnvironment), {1, 1, 1}, error}};
}

TEST(EnvironmentFilm, ALambertSphereUnderAConstantMapOfOneIsItsAlbedo) {
  const Studio studio{.lights = 80, .size = pictureSize};
  const PackedStudio packed(studio, 1500);
  image::Image white(64, 32, 3);
  std::ranges::fill(white.values, 1.f);
  const SharedMap map = mapOf(white);
  const auto camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3}, pictureSize);
  studio::expectAlbedo(filmOf(packed.model, *noWarp(), camera, lightOf(map)).color, camera, studio.albedo);
}

// Weights of cameras and lights apart, and kriging with shadows.
std::array<FrameOptions, 2> bySeparateAndPairs() {
  std::array<FrameOptions, 2> both;
  both[0].shade.interpolation = weights::Interpolation::separate;
  both[1].shade.interpolation = weights::Interpolation::kriging;
  both[1].shadows = true;
  return both;
}

class EnvironmentOfSphere : public studio::PackedSphere<1500> {
protected:
  const SharedMap map = liveliest(32);
};

// Renders a script with a picture on disk. The direction of the texel's light is computed by hand: with z up,
// the middle of the map (-z of the picture) is rotated by the shortest arc from y to z onto +y.
TEST_F(EnvironmentOfSphere, OneBrightTexelIsADirectionalLightFromThere) {
  struct Case {
    int x, y;                 // pixel of 128 x 64; directions are off the axes by half a texel
    const char* placement;    // in the script
    Vec3<double> environment; // direction of the texel's middle
    Mat3<double> objectFromEnvironment;
  };
  const double longitude = 2 * std::numbers::pi * 0.5 / 128, polar = std::numbers::pi * 0.5 / 64;
  // Slightly right of -z and below the horizon; slightly right of +x and below; near the zenith.
  const Vec3<double> front(std::cos(polar) * std::sin(longitude), -std::sin(polar),
                           -std::cos(polar) * std::cos(longitude)),
      right(std::cos(polar) * std::cos(longitude), -std::sin(polar), std::cos(polar) * std::sin(longitude)),
      top(std::sin(polar) * std::sin(longitude), std::cos(polar), -std::sin(polar) * std::cos(longitude));
  const Mat3<double> same = Mat3<double>::Identity();
  Mat3<double> zUp, aboutY, aboutZAfterZUp;
  zUp << 1, 0, 0, 0, 0, -1, 0, 1, 0;    // y -> z, -z -> y
  aboutY << 0, 0, 1, 0, 1, 0, -1, 0, 0; // 90 degrees, counter-clockwise from above: -z -> -x
  const Mat3<double> zUpTurned = zUp * aboutY;
  const Case cases[] = {{64, 32, "", front, same},
                        {96, 32, "", right, same},
                        {64, 0, "", top, same},
                        {64, 32, "up = [0, 0, 2]", front, zUp},
                        {96, 32, "up = [0, 0, 1]", right, zUp},
                        {64, 0, "up = [0, 0, 1]", top, zUp},
                        {64, 32, "rotate_deg = 90", front, aboutY},
                        {96, 32, "rotate_deg = \"45*frame\"", right, aboutY},
                        {64, 32, "up = [0, 0, 1]\nrotate_deg = 90", front, zUpTurned}};
  image::TemporaryFolder folder;
  for (const Case& one : cases) {
    image::Image texel(128, 64, 3);
    std::ranges::copy(std::array{300.f, 200.f, 100.f}, texel.at(one.x, one.y).begin());
    image::writeExr(folder / "texel.exr", texel, image::Precision::single);
    const scene::Script script =
        scene::parseScript(std::string("[[light]]\ntype = \"environment\"\nimage = \"texel.exr\"\n"
                                       "color = [0.5, 1, 1]\nintensity = 2\n") +
                               one.placement,
                           folder / "shot.toml");
    const auto environments = scene::readEnvironments(script, {});
    ASSERT_EQ(environments.size(), 1u);
    const auto lights = scene::lightsAt(script, scene::shotTime(script, 2), environments);
    const auto solidAngle = static_cast<float>(
        2 * std::numbers::pi / 128 *
        (std::cos(std::numbers::pi * one.y / 64) - std::cos(std::numbers::pi * (one.y + 1) / 64)));
    const Vec3<double> towards = one.objectFromEnvironment * one.environment;
    const std::vector<ShotLight> lamp{ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(towards),
                                                           solidAngle * Rgb{300, 400, 200}}};
    // Seen from the side of the light, where a light from another direction would be visible at once.
    const auto facing = cameraFrom<ObjectSpace>(towards + Vec3<double>(0.2, 0.3, 0.1), pictureSize);
    for (FrameOptions options : bySeparateAndPairs()) {
      options.aovs = {"light_blend"};
      const FrameLayers underLamp = filmOf(model(), *noWarp(), facing, lamp, options),
                        underMap = filmOf(model(), *noWarp(), facing, lights, options);
      const image::Image &expected = underLamp.color, &got = underMap.color;
      EXPECT_LT(largestDifference(underMap.aovs.at("light_blend"), underLamp.aovs.at("light_blend")), 0.02);
      const float brightest = *std::ranges::max_element(expected.values);
      EXPECT_LT(largestDifference(got, expected) / brightest, 0.001) << one.placement << ' ' << one.x;
      EXPECT_GT(largestDifference(got, image::Image(got.width, got.height, 4)), 0.5 * brightest);
    }
  }
}

// Relighting of a still object as in the paper [Weyrich 2005, Fig. 2]: the map is filtered once by the
// weights of the captured lights, and the photographs are summed with these weights. Computed texel by texel.
TEST_F(EnvironmentOfSphere, WithoutAWarpItIsRelightingByTheMapFilteredOnce) {
  FrameOptions plain;
  plain.shade.foreshortened = false; // otherwise weights depend on the normal
  plain.shade.lights = 4;
  plain.shade.lightFit = weights::LightFit::plane; // less steep than the mean
  const auto& rig = model().rig.lights;
  std::vector<Vec3<double>> filtered(rig.size(), Vec3<double>::Zero());
  std::vector<Direction3<AcquisitionSpace>> towardsCaptured;
  std::vector<Direction3<AcquisitionSpace, double>> covering;
  for (const capture::Light& light : rig) {
    covering.push_back(std::get<capture::DirectionalLight>(light.kind).towards);
    towardsCaptured.push_back(covering.back().cast<float>());
  }
  const weights::LightExtrapolationFade coverage(covering);
  for (const auto& texel : map->lights) {
    const auto towards = assume<Direction3<AcquisitionSpace>>(texel.towards.raw());
    for (const auto& [light, weight] :
         weights::blendOfLights(towardsCaptured, towards, weights::lightBlend(model(), plain.shade), coverage,
                                weights::LightExtrapolation::fade))
      filtered[light] += weight * Vec3<double>(texel.irradiance.r, texel.irradiance.g, texel.irradiance.b);
  }
  image::Image relit(pictureSize, pictureSize, 4);
  for (size_t l = 0; l < rig.size(); ++l) {
    const auto& light = std::get<capture::DirectionalLight>(rig[l].kind);
    const auto towards = assume<Direction3<ObjectSpace, double>>(light.towards.raw());
    const image::Image alone =
        filmOf(model(), *noWarp(), camera, {ShotDirectionalLight{towards, light.irradiance}}, plain).color;
    const std::array captured{light.irradiance.r, light.irradiance.g, light.irradiance.b};
    for (size_t i = 0; i < alone.values.size(); ++i)
      if (i % 4 < 3)
        relit.values[i] +=
            alone.values[i] * static_cast<float>(filtered[l][static_cast<int>(i % 4)]) / captured[i % 4];
      else
        relit.values[i] = alone.values[i];
  }
  const float brightest = *std::ranges::max_element(relit.values);
  const image::Image film = filmOf(model(), *noWarp(), camera, lightOf(map), plain).color;
  EXPECT_LT(rootMeanSquare(film, relit) / brightest, 0.0006);
  EXPECT_LT(largestDifference(film, relit) / brightest, 0.004);

  // Every surfel has the same weights.
  const auto deformed = warp::deform(model().cloud, *noWarp());
  const std::vector<uint32_t> some{3, 500, 1200};
  const PreparedEnvironment prepared =
      prepareEnvironment(*map, 0.01, weights::LightExtrapolation::fade, model(), plain.shade);
  const PreparedEnvironment* const environments[] = {&prepared};
  const auto batch = queriesAt(model().cloud, deformed, some, camera, lightOf(map), environments);
  for (const auto& turn : batch.acquisitionFromEnvironment)
    EXPECT_LT((turn.matrix() - Mat3<float>::Identity()).norm(), 1e-6);
}

// Compares with a light for each texel of the map, without a table, under a warp.
TEST_F(EnvironmentOfSphere, ItsErrorIsWhatItWasAskedFor) {
  const auto warp = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(70), {0, 0, 0});
  const PreparedEnvironment exact{map->lights, weights::LightExtrapolation::fade, std::nullopt, {}};
  const PreparedEnvironment* const environments[] = {&exact};
  const auto deformed = warp::deform(model().cloud, *warp);
  const splat::SplatRaster raster = look(camera, model().cloud, deformed);
  codec::BlockCache cache(model().files, size_t{1} << 28);
  shading::ShadingStats stats;
  const image::Image truth = developRadiance(
      raster,
      shading::shade(model(),
                     queriesAt(model().cloud, deformed, raster.visible, camera, lightOf(map), environments),
                     {}, cache, stats));
  const float brightest = *std::ranges::max_element(truth.values);
  for (const double error : {0.1, 0.01}) {
    const auto prepared = prepareEnvironment(*map, error, weights::LightExtrapolation::fade, model(), {});
    EXPECT_LT(prepared.lights.size(), map->lights.size() / 5);
    const image::Image film =
        filmOf(model(), *warp, camera, lightOf(map, Mat3<double>::Identity(), error)).color;
    EXPECT_LT(rootMeanSquare(film, truth) / brightest, error / 10);
    EXPECT_LT(largestDifference(film, truth) / brightest, error);
  }
}

// Error of the weights of captured lights, relative to their sum, against weights computed texel by texel: it
// must stay below `error`. For rigs of several sizes, a map with strong variation and a constant map,
// randomly rotated.
TEST(PrepareEnvironment, WeightsErrByLessThanWasAskedFor) {
  constexpr weights::LightBlend mean{3, weights::LightFit::mean}, plane{4, weights::LightFit::plane};
  constexpr int height = 128;
  image::Image white(2 * height, height, 3);
  std::ranges::fill(white.values, 1.f);
  std::mt19937 random(5);
  for (const auto& [lights, how] : {std::pair{28, mean}, {60, mean}, {200, mean}, {60, plane}}) {
    model::Model model;
    model.rig.lights = studio::studioLights(lights);
    std::vector<Direction3<AcquisitionSpace>> captured;
    std::vector<Direction3<AcquisitionSpace, double>> covering;
    for (const capture::Light& light : model.rig.lights) {
      covering.push_back(std::get<capture::DirectionalLight>(light.kind).towards);
      captured.push_back(covering.back().cast<float>());
    }
    const weights::LightExtrapolationFade coverage(covering);
    const auto weightsOf = [&](std::span<const weights::EnvironmentLight> environment,
                               const Mat3<float>& turn) {
      std::vector<double> weights(model.rig.lights.size());
      double whole = 0;
      for (const auto& [direction, irradiance, spread] : environment) {
        const auto towards = assume<Direction3<AcquisitionSpace>>(turn * direction.raw());
        for (const auto& [light, weight] :
             weights::blendOfLights(captured, towards, how, coverage, weights::LightExtrapolation::clamp))
          weights[light] += weight * irradiance.g;
        whole += irradiance.g;
      }
      for (double& weight : weights) weight /= whole;
      return weights;
    };
    for (const SharedMap& map : {mapOf(white), liveliest(height)}) {
      std::vector<Mat3<float>> turns;
      std::vector<std::vector<double>> exact;
      for (int trial = 0; trial < 3; ++trial) {
        turns.push_back(studio::randomMotion(random).rigid().rotation().cast<float>());
        exact.push_back(weightsOf(map->lights, turns.back()));
      }
      for (const double error : {0.1, 0.03, 0.01}) {
        const auto prepared = prepareEnvironment(*map, error, weights::LightExtrapolation::clamp, model, {});
        for (size_t trial = 0; trial < turns.size(); ++trial) {
          const auto got = weightsOf(prepared.lights, turns[trial]);
          double sum = 0;
          for (size_t l = 0; l < got.size(); ++l) sum += std::abs(got[l] - exact[trial][l]);
          EXPECT_LT(sum, error) << lights << " lights"; // 0.27 to 0.9 of the error
        }
      }
    }
  }
}

TEST_F(EnvironmentOfSphere, OneRigidMotionOfEverythingLeavesTheImageUnchanged) {
  for (const FrameOptions& options : bySeparateAndPairs()) {
    const image::Image still = filmOf(model(), *noWarp(), camera, lightOf(map), options).color;
    std::mt19937 random(1);
    for (int trial = 0; trial < 3; ++trial) {
      const studio::RigidMotion motion = studio::randomMotion(random);
      const image::Image moved =
          filmOf(model(), *motion.warp(), motion(camera), lightOf(map, motion.rigid().rotation()), options)
              .color;
      EXPECT_LT(largestDifference(moved, still) / *std::ranges::max_element(still.values), 2e-5);
    }
  }
}

TEST_F(EnvironmentOfSphere, AMirroredWorldGivesTheMirroredImage) {
  const auto warp = warp::scaleWarp({-1, 1, 1}, Vec3<double>::Zero());
  for (const FrameOptions& options : bySeparateAndPairs()) {
    const image::Image still = filmOf(model(), *noWarp(), camera, lightOf(map), options).color;
    const image::Image mirrored =
        filmOf(model(), *warp, studio::mirrored(camera), lightOf(map, studio::mirror), options).color;
    EXPECT_LT(largestDifference(studio::flipped(mirrored), still) / *std::ranges::max_element(still.values),
              2e-5);
  }
}

TEST_F(EnvironmentOfSphere, AddsUpWithLampsAndItsBlendIsTheMean) {
  const ShotPointLight lamp{{2, 1, 2}, {9, 8, 7}};
  FrameOptions options;
  options.aovs = {"light_blend"};
  const FrameLayers mapAlone = filmOf(model(), *noWarp(), camera, lightOf(map), options),
                    lampAlone = filmOf(model(), *noWarp(), camera, {lamp}, options),
                    both = filmOf(model(), *noWarp(), camera, {lamp, lightOf(map)[0]}, options);
  image::Image sum = mapAlone.color, mean = mapAlone.aovs.at("light_blend");
  for (size_t i = 0; i < sum.values.size(); ++i)
    if (i % 4 < 3) sum.values[i] += lampAlone.color.values[i];
  for (size_t i = 0; i < mean.values.size(); ++i)
    mean.values[i] = (mean.values[i] + lampAlone.aovs.at("light_blend").values[i]) / 2;
  EXPECT_LT(largestDifference(both.color, sum) / *std::ranges::max_element(sum.values), 1e-5);
  EXPECT_LT(largestDifference(both.aovs.at("light_blend"), mean), 1e-5);
}

// Kriging changes the picture under a map as it changes the picture under the map's key lights.
TEST_F(EnvironmentOfSphere, KeyLightsAreWeightedByPairs) {
  FrameOptions separate, kriging;
  separate.shade.interpolation = weights::Interpolation::separate;
  kriging.shade.interpolation = weights::Interpolation::kriging;
  kriging.shadows = true;
  EnvironmentCache cache;
  const auto still = noWarp();
  const scene::Scene scene{*still, camera, lightOf(map)};
  const LitScene whole = litScene(scene, 0, model(), separate.shade, cache),
                 lit = litScene(scene, 0, model(), kriging.shade, cache);
  EXPECT_EQ(whole.scene.lights.size(), 1u);
  ASSERT_GT(lit.scene.lights.size(), 2u); // the map, and at least its suns
  const std::vector<ShotLight> keys(lit.scene.lights.begin() + 1, lit.scene.lights.end());
  EXPECT_EQ(keys.size() + lit.environments[0]->lights.size(), whole.environments[0]->lights.size());
  const auto change = [&](const std::vector<ShotLight>& lights) {
    image::Image film = filmOf(model(), *noWarp(), camera, lights, kriging).color;
    const image::Image apart = filmOf(model(), *noWarp(), camera, lights, separate).color;
    for (size_t i = 0; i < film.values.size(); ++i) film.values[i] -= apart.values[i];
    return film;
  };
  const image::Image ofMap = change(lightOf(map)), ofKeys = change(keys);
  const float most = *std::ranges::max_element(ofKeys.values);
  EXPECT_GT(most, 0);
  EXPECT_LT(largestDifference(ofMap, ofKeys), 0.02 * most);
}

using EnvironmentOfTables = studio::TableQueries;

// Tables see each light as a dot: dots of a smooth map are no further apart than the nodes of a table.
TEST_F(EnvironmentOfTables, HasLightsAsNearAsTheTablesResolveWhateverItsError) {
  image::Image white(128, 64, 3);
  std::ranges::fill(white.values, 1.f);
  const SharedMap map = mapOf(white);
  EnvironmentCache cache;
  const auto farthestNeighbour = [&](weights::Interpolation interpolation) {
    weights::ShadeOptions options;
    options.interpolation = interpolation;
    const auto environment = std::get<ShotEnvironment>(lightOf(map, Mat3<double>::Identity(), 0.1)[0]);
    const std::vector<weights::EnvironmentLight>& lights = cache.prepared(environment, model, options).lights;
    double farthest = 0;
    for (const auto& light : lights) {
      double nearest = 2;
      for (const auto& other : lights)
        if (&other != &light)
          nearest = std::min(nearest, double{(light.towards.raw() - other.towards.raw()).norm()});
      farthest = std::max(farthest, nearest);
    }
    return farthest;
  };
  EXPECT_GT(farthestNeighbour(weights::Interpolation::kriging), 0.2);
  EXPECT_LT(farthestNeighbour(weights::Interpolation::shared), 0.12);
}

TEST_F(EnvironmentOfSphere, IsPreparedOnceForEachMapAndSetting) {
  EnvironmentCache cache;
  const auto light = [&](double error) {
    return std::get<ShotEnvironment>(lightOf(map, Mat3<double>::Identity(), error)[0]);
  };
  const PreparedEnvironment& fine = cache.prepared(light(0.01), model(), {});
  const PreparedEnvironment& coarse = cache.prepared(light(0.1), model(), {});
  EXPECT_EQ(&cache.prepared(light(0.01), model(), {}), &fine);
  EXPECT_LT(coarse.lights.size(), fine.lights.size());
  EXPECT_EQ(&cache.prepared(coarsened(light(0.01), 0.1), model(), {}), &coarse);
  EXPECT_EQ(&cache.prepared(coarsened(light(0.1), 0.01), model(), {}), &coarse);
  weights::ShadeOptions nearest;
  nearest.nearest = true;
  EXPECT_NE(&cache.prepared(light(0.01), model(), nearest), &fine);
  weights::ShadeOptions kriging;
  kriging.interpolation = weights::Interpolation::kriging;
  EXPECT_NE(&cache.prepared(light(0.01), model(), kriging), &fine);
}

} // namespace
} // namespace surflect::surfels
