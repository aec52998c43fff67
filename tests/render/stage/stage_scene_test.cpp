#include "render/stage/stage_scene.h"

#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/image_file.h"
#include "srf/image/png.h"
#include "tests/render/stage/stages.h"
#include "tests/srf/image/files.h"
#include "tests/support/color_files.h"

#include <gtest/gtest.h>

namespace surflect::stage {

namespace {

TEST(Texture, ShowsTexelsWhereTheyAre) {
  const image::TemporaryFolder folder;
  const image::Image image = image::randomImage(5, 4, 3, 0, 1, 1);
  image::writePng(folder / "t.png", image, 16);
  const Texture texture(std::make_shared<const image::Image>(readTexels(folder / "t.png", Texels::colors)), 3,
                        2);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 5; ++x)
      for (const auto& [column, row] : {std::pair{0, 0}, {2, 1}}) {
        const Rgb got = texture.at({(column + (x + 0.5) / 5) / 3, (row + 1 - (y + 0.5) / 4) / 2});
        EXPECT_NEAR(got.r, image::linearFromSrgb(image.at(x, y)[0]), 1e-4);
        EXPECT_NEAR(got.b, image::linearFromSrgb(image.at(x, y)[2]), 1e-4);
      }
}

TEST(Texture, IsLinearBetweenTexelsAndGoesRound) {
  const image::TemporaryFolder folder;
  image::Image ramp(4, 1, 1);
  ramp.values = {0, 0.25f, 0.5f, 1};
  image::writeExr(folder / "t.exr", ramp, image::Precision::single);
  const Texture texture(std::make_shared<const image::Image>(readTexels(folder / "t.exr", Texels::colors)), 1,
                        1);
  EXPECT_NEAR(texture.at({0.25, 0.3}).g, 0.125, 1e-6);
  EXPECT_NEAR(texture.at({0.75, 0.9}).g, 0.75, 1e-6);
  EXPECT_NEAR(texture.at({0, 0}).g, 0.5, 1e-6); // between the last and the first
  EXPECT_NEAR(texture.at({1, 1}).g, 0.5, 1e-6);
}

TEST(Texture, RefusesWhatIsNoReflectance) {
  const image::TemporaryFolder folder;
  EXPECT_NE(image::errorOf([&] { readTexels(folder / "missing.png", Texels::colors); }).find("missing.png"),
            std::string::npos);
  image::Image bright(2, 2, 3);
  bright.values[7] = 1.5f;
  image::writeExr(folder / "bright.exr", bright, image::Precision::single);
  EXPECT_NE(image::errorOf([&] { readTexels(folder / "bright.exr", Texels::colors); }).find("pixel[0, 1]"),
            std::string::npos);
  image::writeExr(folder / "alpha.exr", image::Image(2, 2, 4));
  EXPECT_NE(image::errorOf([&] { readTexels(folder / "alpha.exr", Texels::colors); }).find("alpha"),
            std::string::npos);
}

TEST(Texture, WithAProfileIsReadWithinItsGamut) {
  const image::TemporaryFolder folder;
  const auto write = [&](const Rgb& color, const image::Primaries& primaries) {
    image::Image image(1, 1, 3);
    image.values = {color.r, color.g, color.b};
    image::writePng(folder / "t.png", image);
    const std::string profile = iccpContent(profileBytes(primaries, ProfileCurve::srgb));
    image::writeBytes(folder / "t.png", withChunk(readFile(folder / "t.png"), "iCCP", profile));
  };
  for (const float level : {0.f, 0.2f, 0.6f, 1.f}) {
    write({level, level, level}, image::kRec709);
    for (const float value : readTexels(folder / "t.png", Texels::colors).values) {
      EXPECT_NEAR(value, image::linearFromSrgb(level), 1e-4f);
      EXPECT_TRUE(value >= 0 && value <= 1) << value;
    }
  }
  write({1, 0, 0}, image::kDisplayP3);
  const std::string complaint = image::errorOf([&] { readTexels(folder / "t.png", Texels::colors); });
  EXPECT_NE(complaint.find("t.png: pixel[0, 0]: the colour lies outside of Rec. 709's gamut (1.2"),
            std::string::npos)
      << complaint;
  EXPECT_EQ(readTexels(folder / "t.png", Texels::factors).values, (std::vector{1.f, 0.f, 0.f}));
}

// A box whose side shows half of a texture black: seen straight on, left and right differ as the texture
// does.
TEST(Texture, LiesOnTheSurfaceAndBendsWithIt) {
  image::Image halves(64, 1, 3);
  for (int x = 32; x < 64; ++x) std::ranges::fill(halves.at(x, 0), 1.f);
  std::vector<StageObject> objects =
      oneObject(box({0, 0, 0}, {2, 2, 2}, 8), material::Lambert{{0.5f, 0.5f, 0.5f}});
  objects[0].textures.color =
      std::make_shared<const Texture>(std::make_shared<const image::Image>(halves), 1, 1);
  TraceOptions options;
  options.samples = 16;
  const capture::Camera camera =
      setPlaces(unit(1, 0, 0), 5, 8, 4, capture::Lens::Model::orthographic); // +y is to the right
  const auto leftAndRight = [&] {
    const TracedView view =
        traceView(StageScene(objects), camera, 0, std::vector{sun({1, 0, 0})}, options, {});
    return std::pair{view.radiance[0].at(1, 4)[0], view.radiance[0].at(6, 4)[0]};
  };
  EXPECT_EQ(leftAndRight().first, 0);
  EXPECT_NEAR(leftAndRight().second, 0.5 * 3 / material::kPi, 1e-5);
  const auto turn = warp::rigidWarp({1, 0, 0}, Angle::fromDegrees(180), {0, 0, 0}, {0, 0, 0});
  objects[0].surface = deformed(objects[0].surface, *turn);
  EXPECT_NEAR(leftAndRight().first, 0.5 * 3 / material::kPi, 1e-5);
  EXPECT_EQ(leftAndRight().second, 0);
}

TEST(Texture, OfFactorsIsAsStored) {
  const image::TemporaryFolder folder;
  image::Image gray(1, 1, 3);
  std::ranges::fill(gray.values, 0.5f);
  image::writePng(folder / "t.png", gray);
  const float stored = image::readPicture(folder / "t.png").image.values[0];
  EXPECT_EQ(readTexels(folder / "t.png", Texels::factors).values[0], stored);
  EXPECT_LT(readTexels(folder / "t.png", Texels::colors).values[0], stored);
}

TEST(Texture, VariesColourAndRoughness) {
  const Rgb half{0.5f, 0.5f, 0.5f};
  const material::Ward ward{{0.4f, 0.4f, 0.4f}, {0.2f, 0.2f, 0.2f}, {0.1, 0.2}};
  const auto variedWard = std::get<material::Ward>(varied(ward, half, 0.25));
  EXPECT_EQ(variedWard.diffuse, (Rgb{0.2f, 0.2f, 0.2f}));
  EXPECT_EQ(variedWard.specular, ward.specular);
  EXPECT_EQ(variedWard.alpha.x, 0.025);
  EXPECT_EQ(variedWard.alpha.y, 0.05);
  const auto coat = std::get<material::ClearCoat>(varied(material::ClearCoat{1.5, 0.3, ward}, half, 0.25));
  EXPECT_EQ(std::get<material::Ward>(coat.base).diffuse, (Rgb{0.2f, 0.2f, 0.2f}));
  EXPECT_EQ(std::get<material::Ward>(coat.base).alpha.y, 0.05);
  EXPECT_EQ(coat.alpha, 0.3);
  const material::Conductor metal{{0.8f, 0.6f, 0.4f}, half, {0.4, 0.4}};
  const auto variedMetal = std::get<material::Conductor>(varied(metal, half, 0.5));
  EXPECT_EQ(variedMetal.color, (Rgb{0.4f, 0.3f, 0.2f}));
  EXPECT_EQ(variedMetal.grazingTint, half);
  EXPECT_EQ(variedMetal.alpha.x, 0.2);
  EXPECT_EQ(std::get<material::RoughDiffuse>(varied(material::RoughDiffuse{half, 0.8}, half, 0.5)).roughness,
            0.4);
  material::Dielectric glass{1.5};
  glass.alpha = 0.4;
  EXPECT_EQ(std::get<material::Dielectric>(varied(glass, half, 0.5)).alpha, 0.2);
}

// Seen straight on under a lamp behind the camera: where the texture makes the metal a mirror it shows
// nothing of a lamp without extent, elsewhere what the material gives.
TEST(Texture, OfRoughnessPolishes) {
  image::Image halves(64, 1, 3);
  for (int x = 32; x < 64; ++x) std::ranges::fill(halves.at(x, 0), 1.f);
  const material::EnergyCompensation losses = material::mirrorEnergyCompensation();
  const material::Conductor metal{{0.9f, 0.9f, 0.9f}, {1, 1, 1}, {0.3, 0.3}, &losses};
  std::vector<StageObject> objects = oneObject(box({0, 0, 0}, {2, 2, 2}, 8), metal);
  objects[0].textures.roughness =
      std::make_shared<const Texture>(std::make_shared<const image::Image>(halves), 1, 1);
  TraceOptions options;
  options.samples = 16;
  const capture::Camera camera =
      setPlaces(unit(1, 0, 0), 5, 8, 4, capture::Lens::Model::orthographic); // +y is to the right
  const image::Image seen =
      traceView(StageScene(objects), camera, 0, std::vector{sun({1, 0, 0})}, options, {}).radiance[0];
  EXPECT_EQ(seen.at(1, 4)[0], 0);
  const material::ShadingDirection up(0, 0, 1);
  EXPECT_NEAR(seen.at(6, 4)[0], 3 * material::evaluate(material::Material(metal), up, up).r, 1e-5);
}

} // namespace

namespace {

TEST(StageScene, KnowsWhatIsInsideOfAnObject) {
  std::vector<StageObject> objects = oneObject(sphere({1, 2, 3}, 1, 32), material::Lambert{});
  objects.push_back({box({1, 2, 6}, {2, 2, 2}, 1), material::Lambert{}});
  const StageScene scene(objects);
  EXPECT_TRUE(isInside(scene, {1, 2, 3}));
  EXPECT_TRUE(isInside(scene, {1.5, 2.4, 3.5}));
  EXPECT_TRUE(isInside(scene, {1.6, 2.6, 6.6}));
  EXPECT_FALSE(isInside(scene, {1, 2, 4.5})); // between them
  EXPECT_FALSE(isInside(scene, {3, 2, 3}));
}

// A ray's result depends neither on the other rays nor on the beam hint.
TEST(StageScene, RaysTogetherMeetWhatTheyMeetAlone) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.2, 1.2), distances(0.1, 3);
  std::uniform_int_distribution<size_t> counts(0, kMostRays);
  std::vector<StageObject> objects = oneObject(bumpySphere({5, 0, 0}, 0.9, 0.3, 6, 48), material::Lambert{});
  objects.push_back({box({5.9, 0.4, 0.3}, {0.3, 0.6, 0.5}, 1), material::Lambert{}});
  const StageScene scene(objects);
  int met = 0, all = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const size_t count = counts(random);
    const StageDirection common = randomDirection(random);
    std::vector<ShadowRay> rays;
    std::vector<bool> isMet;
    for (size_t i = 0; i < count; ++i) {
      const StagePoint origin(5 + uniform(random), uniform(random), uniform(random));
      const StageDirection direction = trial % 2 ? common : randomDirection(random);
      const double distance = distances(random);
      rays.push_back(scene.shadowRay(origin, direction, distance));
      const auto hit = scene.firstHit(origin, direction);
      isMet.push_back(hit && hit->distance < distance);
    }
    for (const Beam beam : {Beam::narrow, Beam::wide}) {
      const uint32_t occluded = scene.occluded(rays, beam);
      EXPECT_EQ(occluded >> rays.size(), 0u);
      for (size_t i = 0; i < rays.size(); ++i) {
        EXPECT_EQ(occluded >> i & 1, isMet[i]) << trial << ' ' << i;
        met += isMet[i];
        ++all;
      }
    }
  }
  EXPECT_GT(met, all / 10);
  EXPECT_LT(met, all * 9 / 10);
}

// On the triangle, at the distance from the origin; and a ray that leaves does not meet the same triangle.
TEST(StageScene, HitsLieOnTheirRays) {
  std::mt19937 random(2);
  const StageScene scene(oneObject(sphere({3, 0, 0}, 1, 64), material::Lambert{}));
  for (int trial = 0; trial < 500; ++trial) {
    const StageDirection in = randomDirection(random), out = randomDirection(random);
    const auto hit = scene.firstHit({3, 0, 0}, in);
    ASSERT_TRUE(hit);
    EXPECT_LT((hit->position.raw() - (Vec3<double>(3, 0, 0) + hit->distance * in.raw())).norm(), 1e-5);
    const StageDirection away = dot(out, hit->facet) < 0 ? -out : out;
    EXPECT_FALSE(scene.firstHit(scene.leaving(*hit, away), away)) << trial;
  }
}

} // namespace

} // namespace surflect::stage
