// Photographs blended at a pixel (render/surfels/frame.h).
#include "render/surfels/frame.h"
#include "render/surfels/queries.h"
#include "render/surfels/surfel_method.h"
#include "srf/weights/light_weights.h"
#include "tests/render/films.h"
#include "tests/srf/shading/queries.h"
#include "warp/deform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace surflect::surfels {
namespace {

using studio::cameraFrom;
using studio::noWarp;
using studio::pictureSize;

double sumOf(const method::PhotographBlend& blend) {
  double sum = 0;
  for (const method::BlendedPhotograph& photograph : blend.photographs) sum += photograph.weight;
  return sum;
}

// A camera whose picture of 9 x 9 pixels is filled by what surrounds a point, which lies in its middle.
capture::Camera<ObjectSpace> closeUp(capture::Camera<ObjectSpace> camera, const Point3<ObjectSpace>& point) {
  camera.lens.width = camera.lens.height = 9;
  camera.lens.focalX *= 60, camera.lens.focalY *= 60;
  camera.lens.centerX = camera.lens.centerY = 0;
  const capture::Pixel pixel = *camera.project(point.cast<double>());
  camera.lens.centerX = 4.5 - pixel.x, camera.lens.centerY = 4.5 - pixel.y;
  return camera;
}

class BlendedAt : public studio::PackedSphere<3000> {
protected:
  method::PhotographBlend blendOf(const capture::Camera<ObjectSpace>& from, capture::Pixel pixel,
                                  const std::vector<scene::ShotLight>& lights, const FrameOptions& options) {
    return blendedAt(model(), {*noWarp(), from, lights}, pixel, options, workspace);
  }

  FrameWorkspace workspace{model(), size_t{1} << 26};
  const std::vector<scene::ShotLight> lamp{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
};

// The surfel in the middle of a close-up shares its pixel with neighbours alone, which look nearly the same.
TEST_F(BlendedAt, ItsWeightsAreThoseOfTheFrame) {
  const auto twist = warp::twistWarp({0, 1, 0}, Angle::fromDegrees(50), {0, 0, 0});
  const DeformedCloud deformed = warp::deform(model().cloud, *twist);
  const splat::SplatRaster raster = look(camera, model().cloud, deformed);
  const std::vector<Rgb> viewColors = weights::blendColors(model().rig.views.size());
  FrameOptions options;
  options.shade.interpolation = weights::Interpolation::separate;
  options.aovs = {"camera_blend"};
  weights::ShadeOptions showing = options.shade;
  showing.showsBlends = true;
  for (const auto& [x, y] : {std::pair{20, 20}, {15, 22}, {26, 17}, {22, 28}}) {
    const std::optional<uint32_t> surfel = splat::heaviestSplat(raster, x, y);
    ASSERT_TRUE(surfel);
    const auto close = closeUp(camera, deformed.p[*surfel]);
    const scene::Scene scene{*twist, close, lamp};
    const FrameLayers film = renderFrame(model(), scene, options, workspace);
    ASSERT_EQ(film.color.at(4, 4)[3], 1);
    shading::ShadingStats stats;
    const weights::QueryBatch batch =
        queriesAt(model().cloud, deformed, std::span(&*surfel, 1), close, lamp, {});
    const shading::Shaded shaded = shading::shade(model(), batch, showing, workspace.cache, stats);
    const Rgb& radiance = shaded.radiance[0];
    const std::array expected{radiance.r, radiance.g, radiance.b};
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(film.color.at(4, 4)[c] / expected[c], 1, 0.012);

    const method::PhotographBlend blend = blendedAt(model(), scene, {4.5, 4.5}, options, workspace);
    EXPECT_NEAR(sumOf(blend), 1, 6e-16);
    EXPECT_EQ(blend.tables, 0);
    Rgb color;
    for (const method::BlendedPhotograph& photograph : blend.photographs) {
      const auto view = std::ranges::find(model().rig.views, photograph.view, &capture::View::identity);
      ASSERT_NE(view, model().rig.views.end());
      const auto number = static_cast<size_t>(view - model().rig.views.begin());
      color = color + static_cast<float>(photograph.weight) * viewColors[number];
      const capture::Pixel place = *view->camera.project(model().cloud.p0[*surfel].cast<double>());
      EXPECT_LT(std::hypot(place.x - photograph.place.x, place.y - photograph.place.y), 2e-6);
    }
    const Rgb& blended = shaded.cameraBlend[0];
    EXPECT_NEAR(color.r, blended.r, 2.4e-7);
    EXPECT_NEAR(color.g, blended.g, 2.4e-7);
    EXPECT_NEAR(color.b, blended.b, 2.4e-7);
    const Vec3<float> ofFilm(film.aovs.at("camera_blend").at(4, 4).data());
    EXPECT_LT((ofFilm - Vec3<float>(color.r, color.g, color.b)).norm(), 0.004);
  }
}

TEST_F(BlendedAt, TheNearestPhotographAnswersAlone) {
  FrameOptions options;
  options.shade.nearest = true;
  for (const double x : {16.5, 20.5, 25.5}) {
    const method::PhotographBlend blend = blendOf(camera, {x, 20.5}, lamp, options);
    ASSERT_EQ(blend.photographs.size(), 1u);
    EXPECT_EQ(blend.photographs[0].weight, 1);
  }
}

TEST_F(BlendedAt, ACapturedCameraAndLightAreAnsweredByTheirOwnPhotograph) {
  for (const auto kind : {weights::Interpolation::separate, weights::Interpolation::kriging})
    for (const size_t view : {2u, 9u}) {
      const capture::View& captured = model().rig.views[view];
      const auto own = scene::inObjectSpace(captured.camera);
      const capture::Pixel pixel{pictureSize / 2 + 3.5, pictureSize / 2 - 2.5};
      const Vec3<double> towards = own.center().raw().normalized();
      for (const capture::Light& light : model().rig.lights) {
        if (capture::towardsLight(light, {0, 0, 0}).raw().dot(towards) < 0.4) continue;
        FrameOptions options;
        options.shade.interpolation = kind;
        const method::PhotographBlend blend =
            blendOf(own, pixel, std::vector{scene::inObjectSpace(light)}, options);
        ASSERT_FALSE(blend.photographs.empty());
        EXPECT_EQ(blend.photographs[0].view, captured.identity);
        EXPECT_EQ(blend.photographs[0].light, light.identity);
        EXPECT_GT(blend.photographs[0].weight, 0.997);
        const capture::Pixel& place = blend.photographs[0].place;
        EXPECT_LT(std::hypot(place.x - pixel.x, place.y - pixel.y), 0.9);
      }
    }
}

TEST_F(BlendedAt, ThereIsNothingOffTheObject) {
  for (const capture::Pixel pixel :
       {capture::Pixel{0.5, 0.5}, {-1, 20}, {20, -0.1}, {pictureSize, 20}, {20, pictureSize}})
    EXPECT_TRUE(blendOf(camera, pixel, lamp, {}).photographs.empty());
}

TEST_F(BlendedAt, AsksAsItsRendererDoesAndLeavesItsFramesAsTheyAre) {
  SurfelRenderer renderer(std::make_shared<model::Model>(model::openModel(model().folder)),
                          {{"surfel_size", 2.0}});
  const auto still = noWarp();
  const scene::Scene scene{*still, camera, lamp};
  const std::vector<float> before = renderer.render(scene).color.values;
  const method::PhotographBlend blend = renderer.blendedAt(scene, {20.5, 20.5});
  EXPECT_NEAR(sumOf(blend), 1, 6e-16);
  EXPECT_TRUE(std::ranges::is_sorted(blend.photographs, std::greater(), &method::BlendedPhotograph::weight));
  EXPECT_EQ(renderer.render(scene).color.values, before);
}

TEST(BlendedAtFixedLight, PhotographsHaveNoLight) {
  const studio::PackedStudio packed(studio::Studio{.lights = 0, .size = pictureSize}, 800);
  FrameWorkspace workspace(packed.model, size_t{1} << 24);
  const auto still = noWarp();
  const method::PhotographBlend blend =
      blendedAt(packed.model, {*still, cameraFrom<ObjectSpace>({1, 1, 1}, pictureSize), {}}, {20.5, 20.5}, {},
                workspace);
  EXPECT_GT(blend.photographs.size(), 1u);
  EXPECT_NEAR(sumOf(blend), 1, 6e-16);
  for (const method::BlendedPhotograph& photograph : blend.photographs) EXPECT_EQ(photograph.light, "");
}

using BlendedByTables = studio::TableQueries;

TEST_F(BlendedByTables, TheirShareIsTold) {
  FrameWorkspace workspace(model, size_t{1} << 24);
  FrameOptions options;
  options.shade.interpolation = weights::Interpolation::shared;
  const auto still = noWarp();
  const scene::Scene scene{*still,
                           cameraFrom<ObjectSpace>({1, 0.4, 0.3}, pictureSize),
                           {scene::ShotPointLight{{3, 1, 1}, {9, 8, 7}}}};
  double most = 0;
  for (const double x : {14.5, 20.5, 26.5}) {
    const method::PhotographBlend blend = blendedAt(model, scene, {x, 20.5}, options, workspace);
    EXPECT_GE(blend.tables, 0);
    EXPECT_LE(blend.tables, 1);
    if (!blend.photographs.empty()) EXPECT_NEAR(sumOf(blend), 1, 6e-16);
    most = std::max(most, blend.tables);
  }
  EXPECT_GT(most, 0);
}

} // namespace
} // namespace surflect::surfels
