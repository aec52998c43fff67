#include "render/stage/rig.h"

#include "srf/capture/writer.h"
#include "tests/render/stage/stage_example.h"
#include "tests/render/stage/stages.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace surflect::stage {

namespace {

TEST(StageRig, ATurntableStepsRoundAtEachElevation) {
  const std::array elevations{Angle::fromDegrees(-30), Angle::fromDegrees(60)};
  const auto directions = turntable(8, elevations);
  ASSERT_EQ(directions.size(), 16u);
  for (size_t i = 0; i < directions.size(); ++i) {
    EXPECT_NEAR(directions[i].z(), i < 8 ? -0.5 : std::sqrt(0.75), 1e-12);
    EXPECT_NEAR(length(directions[i]), 1, 1e-12);
    const double azimuth = std::atan2(directions[i].y(), directions[i].x());
    EXPECT_NEAR(std::remainder(azimuth - static_cast<double>(i) * std::numbers::pi / 4, 2 * std::numbers::pi),
                0, 1e-12);
  }
}

TEST(StageRig, ASpiralIsEvenOverItsZone) {
  // Mean of x, y, z and of their squares over the sphere: 0 and 1/3.
  Vec3<double> mean = Vec3<double>::Zero(), squares = Vec3<double>::Zero();
  const auto sphere = spiral(500, -1, 1, Angle::fromDegrees(20));
  for (const auto& d : sphere) mean += d.raw() / 500, squares += d.raw().cwiseAbs2() / 500;
  EXPECT_LT(mean.norm(), 2e-3);
  EXPECT_LT((squares.array() - 1. / 3).abs().maxCoeff(), 2e-3);
  // The nearest neighbours of points that fill a sphere evenly are about sqrt(4 pi / n) apart.
  for (const auto& d : sphere) {
    double nearest = 2;
    for (const auto& other : sphere)
      if (!(other == d)) nearest = std::min(nearest, length(d + -other));
    EXPECT_GT(nearest, 0.7 * std::sqrt(4 * std::numbers::pi / 500));
  }
  for (const auto& d : spiral(50, -0.2, 0.6, Angle())) {
    EXPECT_GE(d.z(), -0.2);
    EXPECT_LE(d.z(), 0.6);
  }
}

TEST(StageRig, CamerasSeeTheCentreInTheMiddleAndStandUpright) {
  capture::Lens lens;
  lens.width = 40, lens.height = 30, lens.focalX = lens.focalY = 50, lens.centerX = 20, lens.centerY = 15;
  const Point3<AcquisitionSpace, double> center(1, 2, 3);
  auto directions = spiral(50, -1, 1, Angle());
  directions.push_back({0, 0, 1});
  directions.push_back({0, 0, -1});
  for (const auto& d : directions) {
    const auto camera = cameraAbout(center, d, 4, lens);
    const auto middle = camera.project(center);
    ASSERT_TRUE(middle);
    EXPECT_NEAR(middle->x, 20, 1e-9);
    EXPECT_NEAR(middle->y, 15, 1e-9);
    EXPECT_LT(length((center + 4.0 * d) - camera.center()), 1e-12);
    EXPECT_NEAR(camera.cameraFromWorld.rotation().determinant(), 1, 1e-12);
    if (std::abs(d.z()) < 1) {
      const auto above = camera.project(center + Direction3<AcquisitionSpace, double>(0, 0, 0.1));
      EXPECT_LT(above->y, 15);
      EXPECT_NEAR(above->x, 20, 1e-9);
    }
  }
}

} // namespace

namespace {

using namespace stage_example;

TEST(RigSection, TestViewsAndLightsAreNew) {
  const Stage stage = parse(example);
  for (size_t i = stage.rig.trainingLights; i < stage.rig.lights.size(); ++i)
    for (size_t j = 0; j < stage.rig.trainingLights; ++j)
      EXPECT_LT(dot(std::get<capture::DirectionalLight>(stage.rig.lights[i].kind).towards,
                    std::get<capture::DirectionalLight>(stage.rig.lights[j].kind).towards),
                0.999);
  for (size_t i = stage.rig.trainingViews; i < stage.rig.views.size(); ++i)
    for (size_t j = 0; j < stage.rig.trainingViews; ++j)
      EXPECT_GT(length(stage.rig.views[i].camera.center() - stage.rig.views[j].camera.center()), 0.05);
}

TEST(RigSection, LightsAtADistanceGiveTheSameIrradianceAtTheCentre) {
  const Stage stage = parse(with("irradiance", "distance = 4\nirradiance"));
  for (const capture::Light& light : stage.rig.lights) {
    const Rgb irradiance = capture::irradianceAt(light, {0, 0, 0.5});
    EXPECT_NEAR(irradiance.r, 3, 1e-5);
    EXPECT_NEAR(irradiance.b, 1, 1e-5);
  }
}

TEST(RigSection, OrthographicCamerasHaveAHeight) {
  const Stage stage = parse(with("pinhole", "orthographic", with("fov_deg = 30", "height = 2")));
  EXPECT_EQ(stage.rig.views[0].camera.lens.model, capture::Lens::Model::orthographic);
  EXPECT_NEAR(stage.rig.views[0].camera.project(StagePoint(0, 0, 0.5))->y, 15, 1e-9);
  EXPECT_NEAR(stage.rig.views[0].camera.lens.focalY, 15, 1e-12);
}

TEST(RigSection, ARigNeedsViewsAndLights) {
  expectError(with("[lights]\ncount = 8\ntest = 2\nirradiance = [3, 2, 1]", ""), {"lights", "missing"});
  expectError(with("count = 8", "count = 0"), {"lights.count", "0"});
  expectError(with("irradiance = [3, 2, 1]", "irradiance = [3, 0, 1]"), {"lights.irradiance[1]"});
  expectError(with("irradiance", "distance = 1e8\nirradiance"), {"lights.irradiance", "1e-12..1e12"});
  expectError(with("irradiance", "distance = 3\nradius_deg = 2\nirradiance"), {"lights.radius_deg"});
  expectError(with("elevations_deg = [-20, 40]", "elevations_deg = []"), {"views.elevations_deg"});
  expectError(with("elevations_deg = [-20, 40]", "elevations_deg = [-20, 95]"), {"views.elevations_deg[1]"});
  expectError(with("turntable = 6", "count = 5\nturntable = 6"), {"views.turntable"});
  expectError(with("fov_deg = 30", "height = 3"), {"camera.height"});
  expectError(with("size = [40, 30]", "size = [16384, 16384]"), {"camera.size"});
  expectError(with("samples = 12", "samples = 0"), {"samples"});
  expectError(with("\"local\"", "\"global\""), {"transport", "global"});
  const auto rigOf = [](int views, int lights) {
    return with("turntable = 6\nelevations_deg = [-20, 40]\ntest = 3", fmt::format("count = {}", views),
                with("count = 8\ntest = 2", fmt::format("count = {}\ntest = 0", lights)));
  };
  EXPECT_EQ(parse(rigOf(1000, 4000)).rig.views.size(), 1000u);
  expectError(rigOf(1000, 4001), {"views: ", "at most 4000000", "1000 views", "4001 lights"});
  expectError(rigOf(100'000, 4096), {"views: ", "at most 4000000", "100000 views"});
}

const std::string kTurntable = "turntable = 6\nelevations_deg = [-20, 40]\ntest = 3\n";
const std::string kCount = "count = 8\ntest = 2\n";

TEST(RigSection, ViewsAndLightsStandWhereListsSay) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> degrees(-89, 89);
  const StagePoint center(0, 0, 0.5);
  std::string angles, directions, positions;
  std::vector<StageDirection> expected;
  for (int i = 0; i < 7; ++i) {
    const double azimuth = 2 * degrees(random), elevation = degrees(random);
    const double a = azimuth * std::numbers::pi / 180, e = elevation * std::numbers::pi / 180;
    const StageDirection d(std::cos(a) * std::cos(e), std::sin(a) * std::cos(e), std::sin(e));
    expected.push_back(d);
    const char* comma = i < 5 ? ", " : i == 5 ? "]\ntest = [" : ", ";
    const auto append = [&](std::string& list, const std::string& element) {
      list += (list.empty() ? "[" : comma) + element;
    };
    append(angles, fmt::format("[{:.17g}, {:.17g}]", azimuth, elevation));
    append(directions, fmt::format("[{:.17g}, {:.17g}, {:.17g}]", 3 * d.x(), 3 * d.y(), 3 * d.z()));
    append(positions, fmt::format("[{:.17g}, {:.17g}, {:.17g}]", 5 * d.x(), 5 * d.y(), 0.5 + 5 * d.z()));
  }
  const std::vector<std::pair<std::string, std::string>> lists = {
      {"angles_deg", angles}, {"directions", directions}, {"positions", positions}};
  for (const auto& [key, list] : lists) {
    const std::string section = key + " = " + list + "]\n";
    std::string text = with(kTurntable, section, with(kCount, section));
    if (key == "positions") text = with("distance = 5\n", "", text);
    const Stage stage = parse(text);
    EXPECT_EQ(stage.rig.trainingViews, 5u);
    EXPECT_EQ(stage.rig.trainingLights, 5u);
    ASSERT_EQ(stage.rig.views.size(), 7u);
    ASSERT_EQ(stage.rig.lights.size(), 7u);
    for (size_t i = 0; i < 7; ++i) {
      const auto& camera = stage.rig.views[i].camera;
      EXPECT_LT(length(camera.center() - (center + 5. * expected[i])), 1e-9) << key;
      EXPECT_NEAR(camera.project(center)->x, 20, 1e-9);
      EXPECT_NEAR(camera.project(center)->y, 15, 1e-9);
      const capture::Light& light = stage.rig.lights[i];
      EXPECT_LT(length(capture::towardsLight(light, center) + -expected[i]), 1e-9) << key;
      EXPECT_NEAR(capture::irradianceAt(light, center).g, 2, 1e-5);
      EXPECT_EQ(std::holds_alternative<capture::PointLight>(light.kind), key == "positions");
    }
  }
}

TEST(RigSection, ListsRefuseWhatIsNoPlace) {
  const auto views = [](const std::string& list) { return with(kTurntable, list + "\n"); };
  const auto lights = [](const std::string& list) { return with(kCount, list + "\n"); };
  expectError(views("directions = [[1, 0, 0], [0, 0, 0]]"), {"views.directions[1]", "not 0"});
  expectError(views("directions = [[1, 0, 0], [0, nan, 1]]"), {"views.directions[1][1]", "nan"});
  expectError(views("directions = []"), {"views.directions", "1 to"});
  expectError(views("directions = [[1, 0]]"), {"views.directions[0]", "3 numbers"});
  expectError(views("directions = [[1, 0, 0]]\ntest = 3"), {"views.test"});
  expectError(views("directions = [[1, 0, 0]]\ntest = [[1]]"), {"views.test[0]"});
  expectError(views("directions = [[1, 0, 0]]\ncount = 3"), {"views.directions", "beside count"});
  expectError(views("directions = [[1, 0, 0]]\nelevations_deg = [3]"), {"views.elevations_deg"});
  expectError(views("angles_deg = [[1, 91]]"), {"views.angles_deg[0][1]", "91"});
  expectError(views("angles_deg = [[1]]"), {"views.angles_deg[0]", "azimuth"});
  expectError(views("positions = [[0, 0, 3]]"), {"camera.distance", "positions"});
  expectError(with("distance = 5\n", ""), {"camera.distance", "missing"});
  expectError(with("distance = 5\n", "", views("positions = [[0, 0, 0.5]]")),
              {"views.positions[0]", "centre"});
  expectError(lights("positions = [[0, 0, 3]]\nradius_deg = 1"), {"lights.radius_deg"});
  expectError(lights("positions = [[0, 0, 3]]\ndistance = 1"), {"lights.distance"});
  expectError(with(kTurntable, ""), {"views.count", "missing"});
}

TEST(RigSection, AnotherCapturesRigCanBeTaken) {
  const image::TemporaryFolder folder;
  const Stage first = parse(example);
  capture::Capture capture;
  capture.lights = first.rig.lights;
  for (size_t v = 0; v < 3; ++v) { // the second for the test
    capture.views.push_back({v == 2 ? "left" : fmt::format("C{}", v), first.rig.views[4 * v].camera});
    for (size_t l = 0; l < capture.lights.size(); ++l) {
      capture::Frame frame;
      frame.view = v;
      frame.light = l;
      frame.picture = "gone.exr";
      frame.split = v == 1 || l == 0 ? capture::Split::test : capture::Split::train;
      capture.frames.push_back(frame);
    }
  }
  capture::writeCapture(capture, folder.path());
  const std::string from = "from = \"" + folder.path().string() + "\"\n";
  const std::string camera = "[camera]\nmodel = \"pinhole\"\nsize = [40, 30]\ndistance = 5\nfov_deg = 30\n";
  const std::string text =
      with(camera, "", with(kTurntable, from, with(kCount + "irradiance = [3, 2, 1]\n", from)));
  const Stage stage = parse(text);
  ASSERT_EQ(stage.rig.views.size(), 3u);
  EXPECT_EQ(stage.rig.trainingViews, 2u);
  EXPECT_EQ(stage.rig.views[1].identity, "left");
  EXPECT_EQ(stage.rig.views[2].identity, "C1");
  EXPECT_EQ(stage.rig.views[1].camera.lens, first.rig.views[0].camera.lens);
  EXPECT_LT(length(stage.rig.views[1].camera.center() - first.rig.views[8].camera.center()), 1e-12);
  EXPECT_EQ(stage.rig.trainingLights, 9u);
  EXPECT_EQ(stage.rig.lights[0], first.rig.lights[1]);
  EXPECT_EQ(stage.rig.lights[9], first.rig.lights[0]);

  // The capture counts as part of the stage.
  capture.lights[3].kind = capture::PointLight{{1, 2, 3}, {4, 5, 6}};
  capture.lights[3].identity = "cluster";
  capture::writeCapture(capture, folder.path());
  EXPECT_NE(parse(text).hash, stage.hash);
  EXPECT_EQ(parse(text).rig.lights[2], capture.lights[3]);
  // Names that no file could have are replaced by numbers.
  capture.views[2].identity = "../left";
  capture::writeCapture(capture, folder.path());
  EXPECT_EQ(parse(text).rig.views[1].identity, "C001");

  expectError(with(kTurntable, from), {"camera", "views.from"});
  expectError(with(kCount, from), {"lights.irradiance", "from"});
  const std::string disc = with("irradiance = [3, 2, 1]\n", "radius_deg = 2\n", with(kCount, from));
  EXPECT_NEAR(parse(disc).rig.lightRadius.degrees(), 2, 1e-12); // some are directional
  capture::Capture points = capture;
  for (capture::Light& light : points.lights) light.kind = capture::PointLight{{1, 2, 3}, {4, 5, 6}};
  capture::writeCapture(points, folder.path());
  expectError(disc, {"lights.radius_deg", "point lights"});
  capture::writeCapture(capture, folder.path());
  expectError(with(kTurntable, from + "test = 2\n", with(camera, "")), {"views.test", "from"});
  EXPECT_NE(image::errorOf([&] {
              parse(with(kTurntable, "from = \"nowhere\"\n", with(camera, "")));
            }).find("nowhere"),
            std::string::npos);
  const std::string long300(300, 'a'); // more than file systems take
  EXPECT_NE(image::errorOf([&] {
              parse(with(kTurntable, "from = \"" + long300 + "\"\n", with(camera, "")));
            }).find("File name too long"),
            std::string::npos);
  for (capture::Frame& frame : capture.frames) frame.split = capture::Split::test;
  capture::writeCapture(capture, folder.path());
  expectError(text, {"views.from", "training frames"});
}

TEST(RigSection, RigsOfThePapersScaleAreRead) {
  const auto scale = [](const std::string& size, const std::string& views, const std::string& lights) {
    return parse(with("size = [40, 30]", size, with(kTurntable, views, with(kCount, lights))));
  };
  const std::string paper = "size = [1360, 1032]";
  const Stage doll =
      scale(paper, "turntable = 72\nelevations_deg = [-20, -5, 10, 25, 40, 55]\n", "count = 60\n");
  EXPECT_EQ(doll.rig.views.size(), 432u);
  EXPECT_EQ(doll.rig.lights.size(), 60u);
  const Stage mug =
      scale(paper, "turntable = 36\nelevations_deg = [-20, -5, 10, 25, 40, 55]\n", "count = 44\n");
  EXPECT_EQ(mug.rig.views.size(), 216u);
  EXPECT_EQ(mug.rig.lights.size(), 44u);
  size_t below = 0; // lights stand all around
  for (const capture::Light& light : mug.rig.lights)
    below += std::get<capture::DirectionalLight>(light.kind).towards.z() < 0;
  EXPECT_EQ(below, 22u);
}

} // namespace

} // namespace surflect::stage
