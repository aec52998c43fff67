#include "render/lightfield/traced/traced_images.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "render/stage/stage_file.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace surflect::traced {
namespace {

namespace fs = std::filesystem;
using spherical::BuildOptions;

constexpr float kAlbedo = 0.5f, kIrradiance = 2;

// A Lambert sphere of radius 1 under `lights` lights from +x, which share an irradiance.
stage::Stage ball(int lights, const std::string& more = "") {
  std::string directions;
  for (int light = 0; light < lights; ++light) directions += "[1, 0, 0], ";
  const std::string share = std::to_string(kIrradiance / static_cast<float>(lights));
  return stage::parseStage("samples = 16\n[camera]\nmodel = \"pinhole\"\nsize = [16, 16]\ndistance = 5\n"
                           "fov_deg = 30\n[views]\ndirections = [[0, 0, 1], [0, 1, 0]]\n"
                           "[lights]\ndirections = [" +
                               directions + "]\nirradiance = [" + share + ", " + share + ", " + share +
                               "]\n" + more +
                               "[[material]]\nname = \"clay\"\ntype = \"lambert\"\nalbedo = [0.5, 0.5, 0.5]\n"
                               "[[object]]\ntype = \"sphere\"\nmaterial = \"clay\"\nradius = 1\n",
                           "stage.toml");
}

class TracedImages : public ::testing::Test {
protected:
  spherical::PencilImage firstImage(const stage::Stage& stage, const fs::path& name,
                                    const BuildOptions& options = {.levels = 1, .size = 64}) {
    report_ = build(stage, options, folder_ / name);
    const lightfield::LightFieldFolder folder(folder_ / name, spherical::kFormat, spherical::kVersion);
    const spherical::SphericalFile file(folder);
    return file.read(0);
  }

  image::TemporaryFolder folder_;
  spherical::BuildReport report_;
};

// Radiance albedo / pi E cos, and height sqrt(1 - rho^2), of a sphere of radius 1.
TEST_F(TracedImages, AreThoseOfALitSphere) {
  const spherical::PencilImage image = firstImage(ball(1), "ball");
  const spherical::Sphere& sphere = report_.shape.sphere;
  const spherical::ImageAxes axes = spherical::axesOf(spherical::DirectionTree(1).direction(0));
  int inside = 0;
  for (int i = 0; i < 500; ++i) {
    const double turn = 2.4 * i, rho = 0.9 * std::sqrt(i / 500.); // points of a disc
    const Vec3<double> normal =
        rho * (std::cos(turn) * axes.u + std::sin(turn) * axes.v) + std::sqrt(1 - rho * rho) * axes.d;
    const Vec3<double> place = spherical::placeOf(sphere, axes, sphere.middle + normal);
    const Vec2<double> texel(place[0], place[1]);
    EXPECT_NEAR(spherical::heightAt(image, texel, 0), place[2], 1.5e-3);
    const Eigen::Vector4d color = spherical::colorAt(image, texel, 0);
    EXPECT_EQ(color[3], 1);
    if (std::abs(normal[0]) < 0.1) continue; // a texel at the terminator is partly lit
    const double radiance = kAlbedo / std::numbers::pi * kIrradiance * std::max(0., normal[0]);
    EXPECT_NEAR(color[0], radiance, 0.006);
    ++inside;
  }
  EXPECT_GT(inside, 400);
}

TEST_F(TracedImages, CoverTheDiscOfASphere) {
  const spherical::PencilImage image = firstImage(ball(1), "ball");
  const double half = report_.shape.sphere.radius;
  // The last level is the mean of all texels: the disc's share of the image.
  EXPECT_NEAR(spherical::colorAt(image, {0.5, 0.5}, 6)[3], std::numbers::pi / (4 * half * half), 1e-3);
}

TEST_F(TracedImages, AddUpOverLights) {
  const spherical::PencilImage one = firstImage(ball(1), "one"), two = firstImage(ball(2), "two");
  for (size_t i = 0; i < one.mips[3].colors.size(); ++i) {
    const Vec2<double> place(0.0625 + 0.125 * static_cast<double>(i % 8),
                             0.0625 + 0.125 * static_cast<double>(i / 8));
    EXPECT_NEAR(spherical::colorAt(one, place, 3)[0], spherical::colorAt(two, place, 3)[0], 1e-3);
  }
}

TEST_F(TracedImages, DoNotDependOnTheNumberOfLevels) {
  const spherical::PencilImage one = firstImage(ball(1), "one", {.levels = 1, .size = 16}),
                               two = firstImage(ball(1), "two", {.levels = 2, .size = 16});
  EXPECT_EQ(one.mips[0].colors, two.mips[0].colors);
  EXPECT_EQ(one.mips[0].heights, two.mips[0].heights);
}

TEST_F(TracedImages, BracketsAreRefused) {
  const stage::Stage stage = ball(1, "[exposure]\ntimes = [1]\n");
  try {
    build(stage, {.levels = 1, .size = 16}, folder_ / "never");
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("exposure"), std::string::npos) << error.what();
  }
  EXPECT_FALSE(fs::exists(folder_ / "never"));
}

} // namespace
} // namespace surflect::traced
