#include "render/scene/turntable.h"

#include "render/scene/scene.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::scene {
namespace {

using Points = std::vector<Point3<AcquisitionSpace>>;

// Looks at the origin from a direction, with the given up.
capture::View viewFrom(const Vec3<double>& direction, const Vec3<double>& up) {
  const Vec3<double> back = direction.normalized(), right = up.cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  capture::View view;
  view.camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -4)};
  return view;
}

// Cameras at the given azimuths from +z, 20 degrees above the equator of y.
capture::Capture yUpRig(const std::vector<double>& azimuthsDeg) {
  capture::Capture rig;
  for (const double azimuth : azimuthsDeg) {
    const double a = azimuth * std::numbers::pi / 180;
    rig.views.push_back(viewFrom({std::sin(a), std::tan(std::numbers::pi / 9), std::cos(a)}, {0, 1, 0}));
  }
  rig.lights = studio::studioLights(12);
  return rig;
}

std::vector<double> around(size_t count) {
  std::vector<double> azimuths;
  for (size_t i = 0; i < count; ++i) azimuths.push_back(360. * double(i) / double(count));
  return azimuths;
}

Points randomPoints(unsigned seed, const Vec3<double>& middle, const Vec3<double>& sizes) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Points points;
  for (int i = 0; i < 200; ++i) {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    points.push_back(assume<Point3<AcquisitionSpace>>(
        Vec3<float>((middle + sizes.cwiseProduct(Vec3<double>(x, y, z))).cast<float>())));
  }
  return points;
}

Script scriptOf(const TurntableObject& object) {
  const Script script = parseScript(turntableScript(object), "/shots/shot.toml");
  requireShot(script);
  return script;
}

capture::Camera<ObjectSpace> cameraOf(const Script& script, int frame) {
  return cameraAt(script, shotTime(script, frame));
}

const Vec3<double> kMiddle(3, -2, 5);
const Points kPoints = randomPoints(1, kMiddle, {0.5, 2, 1});

TEST(Turntable, ItsTextIsAShot) {
  const capture::Capture rig = yUpRig(around(8));
  const Script script = scriptOf({"vase.srf", rig, kPoints});
  EXPECT_EQ(script.model, "/shots/vase.srf");
  EXPECT_EQ(script.frames->count(), 48);
  EXPECT_EQ(script.lights.size(), 3u);
  EXPECT_TRUE(script.warps.empty());
}

TEST(Turntable, AzimuthsOfCamerasAreThoseOfTheOrbitWhereverUpIs) {
  for (const Vec3<double>& up : {Vec3<double>(0, -1, 0), Vec3<double>(0, 0, 1), Vec3<double>(0.6, -0.8, 0)}) {
    const Vec3<double> across = up.cross(Vec3<double>(0.1, 0.2, 1)).normalized();
    capture::Capture rig;
    rig.views.push_back(viewFrom(across, up));
    const TurntableOrbit orbit = turntableOrbit({"vase.srf", rig, kPoints});
    const double azimuth = 0.5 * (orbit.firstAzimuthDeg + orbit.lastAzimuthDeg);
    EXPECT_LT((towardsOrbit(up, Angle::fromDegrees(azimuth), Angle::fromDegrees(0)) - across).norm(), 1e-9);
  }
}

TEST(Turntable, NamesWithQuotesAreQuoted) {
  const capture::Capture rig = yUpRig(around(8));
  EXPECT_EQ(scriptOf({"a \"b\" \\c.srf", rig, kPoints}).model, "/shots/a \"b\" \\c.srf");
}

TEST(Turntable, EveryFrameHoldsAllPoints) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Points points = randomPoints(seed, kMiddle, {0.1 + seed, 1, 3});
    const capture::Capture rig = yUpRig(seed % 2 == 0 ? around(10) : std::vector<double>{-20, 0, 30});
    const Script script = scriptOf({"vase.srf", rig, points});
    for (int frame = 1; frame <= 48; ++frame) {
      const auto camera = cameraOf(script, frame);
      for (const auto& point : points) {
        const auto place = assume<Point3<ObjectSpace, double>>(point.raw().cast<double>());
        const auto pixel = capture::project(camera.lens, camera.cameraFromWorld(place));
        ASSERT_TRUE(pixel) << frame;
        EXPECT_TRUE(pixel->x >= 0 && pixel->x <= camera.lens.width && pixel->y >= 0 &&
                    pixel->y <= camera.lens.height)
            << seed << " " << frame;
      }
    }
  }
}

TEST(Turntable, TheCameraGoesOnceRoundTheObject) {
  const capture::Capture rig = yUpRig(around(8));
  const Script script = scriptOf({"vase.srf", rig, kPoints});
  double turned = 0;
  for (int frame = 1; frame <= 48; ++frame) {
    const auto here = cameraOf(script, frame), next = cameraOf(script, frame + 1);
    const auto azimuthOf = [&](const capture::Camera<ObjectSpace>& camera) {
      const Vec3<double> back = camera.cameraFromWorld.rotation().row(2).transpose();
      EXPECT_NEAR(back.y(), std::sin(std::numbers::pi / 9), 1e-3) << "at the cameras' height";
      return std::atan2(back.x(), back.z());
    };
    turned += std::remainder(azimuthOf(next) - azimuthOf(here), 2 * std::numbers::pi);
  }
  EXPECT_NEAR(turned, 2 * std::numbers::pi, 1e-3);
}

TEST(Turntable, UpIsTheCamerasUp) {
  for (const Vec3<double>& up :
       {Vec3<double>(0, 0, 1), Vec3<double>(0, -1, 0), Vec3<double>(1, 0, 0), Vec3<double>(0.6, 0, 0.8)}) {
    capture::Capture rig;
    const Vec3<double> side = up.unitOrthogonal(), other = up.cross(side);
    for (int i = 0; i < 12; ++i) {
      const double a = std::numbers::pi * i / 6;
      rig.views.push_back(viewFrom(std::cos(a) * side + std::sin(a) * other + 0.3 * up, up));
    }
    const Script script = scriptOf({"vase.srf", rig, kPoints});
    for (int frame = 1; frame <= 48; frame += 7) {
      const auto camera = cameraOf(script, frame);
      const Vec3<double> cameraUp = camera.cameraFromWorld.rotation().row(1).transpose();
      const Vec3<double> right = camera.cameraFromWorld.rotation().row(0).transpose();
      EXPECT_NEAR(right.dot(up), 0, 1e-4);
      EXPECT_GT(cameraUp.dot(up), 0.9);
    }
  }
}

TEST(Turntable, UpIsAnAxisWhereCamerasAreNearlyUpright) {
  capture::Capture rig = yUpRig(around(9));
  for (capture::View& view : rig.views) {
    const auto& pose = view.camera.cameraFromWorld;
    view.camera.cameraFromWorld = {
        Mat3<double>(pose.rotation() * Eigen::AngleAxisd(0.1, Vec3<double>::UnitX()).toRotationMatrix()),
        pose.translation()};
  }
  const std::string text = turntableScript({"vase.srf", rig, kPoints});
  EXPECT_NE(text.find("up = [0, 1, 0]"), std::string::npos) << text;
}

TEST(Turntable, BeforeOneSidedCamerasItSwingsWithinTheirSector) {
  for (const double middle : {0., 100., 180., -170.}) {
    const capture::Capture rig = yUpRig({middle - 40, middle - 10, middle + 5, middle + 40});
    const Script script = scriptOf({"vase.srf", rig, kPoints});
    double least = 1e9, most = -1e9;
    for (int frame = 1; frame <= 49; ++frame) {
      const Vec3<double> back = cameraOf(script, frame).cameraFromWorld.rotation().row(2).transpose();
      const double azimuth = std::atan2(back.x(), back.z()) * 180 / std::numbers::pi;
      const double offset = std::remainder(azimuth - middle, 360.);
      least = std::min(least, offset);
      most = std::max(most, offset);
    }
    EXPECT_NEAR(least, -40, 0.1);
    EXPECT_NEAR(most, 40, 0.1);
    const auto first = cameraOf(script, 1).cameraFromWorld, last = cameraOf(script, 49).cameraFromWorld;
    EXPECT_LT((first.rotation() - last.rotation()).norm(), 1e-6) << "to and fro";
  }
}

TEST(Turntable, LampsStandWherePhotographsWereLit) {
  const capture::Capture rig = yUpRig(around(8));
  const Script script = scriptOf({"vase.srf", rig, kPoints});
  const std::vector<ShotLight> lights = lightsAt(script, shotTime(script, 1));
  ASSERT_EQ(lights.size(), 3u);
  for (const ShotLight& light : lights) {
    const Vec3<double> towards = std::get<ShotDirectionalLight>(light).towards.raw();
    EXPECT_TRUE(std::ranges::any_of(rig.lights, [&](const capture::Light& captured) {
      return (capture::towardsLight(captured, {0, 0, 0}).raw() - towards).norm() < 1e-4;
    }));
  }
}

TEST(Turntable, AnObjectWithItsLightGetsNone) {
  capture::Capture rig = yUpRig(around(8));
  EXPECT_TRUE(scriptOf({"vase.slf", rig, kPoints, true}).lights.empty());
  rig.lights.clear();
  EXPECT_TRUE(scriptOf({"vase.srf", rig, kPoints}).lights.empty());
}

// Lines of a starter script with the n-th of its warps freed; empty if it has fewer.
std::string withWarp(const std::string& text, int n) {
  std::string freed;
  int warps = 0;
  bool isInside = false;
  for (size_t begin = 0, end; begin < text.size(); begin = end + 1) {
    end = text.find('\n', begin);
    std::string line = text.substr(begin, end - begin);
    if (line == "#[[warp]]") isInside = warps++ == n;
    if (line.empty()) isInside = false;
    freed += (isInside ? line.substr(1) : line) + '\n';
  }
  return n < warps ? freed : "";
}

TEST(StarterScript, EachOfItsWarpsBendsTheObjectAndKeepsItInView) {
  for (const Vec3<double>& middle : {Vec3<double>(0, 0, 0), Vec3<double>(3, -2, 40)}) {
    const capture::Capture rig = yUpRig(around(8));
    const Points points = randomPoints(1, middle, {0.4, 1.1, 0.5});
    const TurntableObject object{"a.srf", rig, points};
    const std::string text = starterScript(object);
    EXPECT_TRUE(parseScript(text, "/shots/shot.toml").warps.empty());
    int warps = 0;
    for (std::string freed; !(freed = withWarp(text, warps)).empty(); ++warps) {
      const Script script = parseScript(freed, "/shots/shot.toml");
      ASSERT_EQ(script.warps.size(), 1u) << warps;
      const warp::WarpPointer warp = warpAt(script, shotTime(script, 25));
      const capture::Camera<ObjectSpace> camera = cameraAt(script, shotTime(script, 25));
      double farthest = 0;
      for (const auto& point : points) {
        const Vec3<double> rest = point.raw().cast<double>(), moved = warp->position(rest);
        farthest = std::max(farthest, (moved - rest).norm());
        const auto pixel = camera.project(assume<Point3<ObjectSpace, double>>(moved));
        ASSERT_TRUE(pixel) << warps;
        EXPECT_TRUE(pixel->x > -200 && pixel->x < 1160 && pixel->y > -150 && pixel->y < 870) << warps;
      }
      EXPECT_GT(farthest, 0.05) << warps;
    }
    EXPECT_EQ(warps, 9);
  }
}

TEST(StarterScript, AnObjectWithItsLightHasNoWarps) {
  const capture::Capture rig = yUpRig(around(8));
  const Points points = randomPoints(1, {0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(starterScript({"a.slf", rig, points, true}), turntableScript({"a.slf", rig, points, true}));
}

} // namespace
} // namespace surflect::scene
