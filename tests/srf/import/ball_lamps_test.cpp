#include "srf/import/ball_lamps.h"

#include "srf/image/png.h"
#include "surfel/base/error.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

namespace surflect::importers {
namespace {

using World = AcquisitionSpace;

constexpr int kSize = 160; // pixels; the ball's radius is 36
constexpr double kRadius = 0.5;
const Vec3<double> kLamp(1, 2, 3);

// Pictures of a perfect mirror ball at the origin under a small lamp, from cameras named C1, C10 and C2.
class BallLampsTest : public ::testing::Test {
protected:
  BallLampsTest() {
    const std::vector<Vec3<double>> directions{{0.2, 0, 1}, {1, 0.3, 0.6}, {-0.4, 1, 0.7}};
    const char* const names[] = {"C1", "C10", "C2"};
    for (size_t c = 0; c < 3; ++c) cameras[names[c]] = studio::cameraFrom<World>(directions[c], kSize);
  }
  image::Image coverage(const capture::Camera<World>& camera) const {
    image::Image covered(kSize, kSize, 1);
    forEachPixel(camera, [&](int x, int y, const Vec3<double>& eye, const Vec3<double>& ray) {
      covered.at(x, y)[0] = eye.cross(ray).norm() < kRadius ? 1.f : 0.f;
    });
    return covered;
  }
  // Reflection of a lamp at a place.
  image::Image reflection(const capture::Camera<World>& camera, const Vec3<double>& lamp) const {
    image::Image shown(kSize, kSize, 1);
    forEachPixel(camera, [&](int x, int y, const Vec3<double>& eye, const Vec3<double>& ray) {
      const double b = eye.dot(ray), inside = b * b - eye.squaredNorm() + kRadius * kRadius;
      if (inside < 0) return;
      const Vec3<double> at = eye + (-b - std::sqrt(inside)) * ray, n = at / kRadius;
      const Vec3<double> mirrored = ray - 2 * n.dot(ray) * n;
      const double off = (lamp - at).normalized().cross(mirrored).norm();
      if (mirrored.dot(lamp - at) > 0) shown.at(x, y)[0] = static_cast<float>(std::exp(-off * off / 0.01));
    });
    return shown;
  }
  template <class Work> static void forEachPixel(const capture::Camera<World>& camera, const Work& work) {
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const auto ray = *capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        work(x, y, worldFromCamera(ray.origin).raw(), worldFromCamera(ray.direction).raw());
      }
  }
  void write() const {
    for (const auto& [name, camera] : cameras) {
      image::writePng(folder / (name + "_on.png"), reflection(camera, kLamp), 16);
      image::writePng(folder / (name + "_mask.png"), coverage(camera));
    }
  }
  BallLamps found(const Progress& progress = {}) const {
    return lampsOfBall(folder.path(), "{camera}_{light}.png", cameras, progress);
  }

  image::TemporaryFolder folder;
  std::map<std::string, capture::Camera<World>> cameras;
};

TEST_F(BallLampsTest, StandWhereReflectionsOfSeveralViewsMeet) {
  write();
  const BallLamps ball = found();
  ASSERT_EQ(ball.lamps.size(), 1u);
  const calibration::LampOfRays& lamp = ball.lamps.at("on");
  ASSERT_TRUE(lamp.isNear);
  EXPECT_LT((lamp.place - kLamp).norm(), 0.03 * kLamp.norm());
  for (const std::string& note : ball.notes) EXPECT_EQ(note.find("warning"), note.npos) << note;
}

TEST_F(BallLampsTest, TheMaskOfC10IsNoMaskOfC1) {
  write();
  std::filesystem::rename(folder / "C1_mask.png", folder / "C1x.png");
  try {
    found();
    FAIL() << "another camera's mask is taken";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("C1_on.png: the ball has no outline"), std::string::npos)
        << error.what();
  }
}

TEST_F(BallLampsTest, AreDirectionsWhereCamerasAreNoPinholes) {
  for (auto& [name, camera] : cameras) {
    camera.lens.model = capture::Lens::Model::orthographic;
    camera.lens.focalX = camera.lens.focalY = kSize / 1.5;
  }
  write();
  const BallLamps ball = found();
  const calibration::LampOfRays& lamp = ball.lamps.at("on");
  EXPECT_FALSE(lamp.isNear);
  EXPECT_LT(lamp.towards.cross(kLamp.normalized()).norm(), kRadius / kLamp.norm());
}

TEST_F(BallLampsTest, AnOutlineThatIsNoBallsIsRefused) {
  write();
  image::Image square(kSize, kSize, 1);
  for (int y = 30; y < 60; ++y)
    for (int x = 30; x < 60; ++x) square.at(x, y)[0] = 1;
  image::writePng(folder / "C2_mask.png", square);
  try {
    found();
    FAIL() << "a square is a ball";
  } catch (const Error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("C2_mask.png: found an outline "), text.npos) << text;
    EXPECT_NE(text.find("expected a ball's outline, to 2 % of its radius"), text.npos) << text;
  }
}

TEST_F(BallLampsTest, ABallThatMovedIsTold) {
  write();
  auto& pose = cameras["C2"].cameraFromWorld;
  pose = {pose.rotation(), pose.translation() + Vec3<double>(0.6, 0, 0)};
  const BallLamps ball = found();
  EXPECT_TRUE(std::ranges::any_of(ball.notes, [](const std::string& note) {
    return note.starts_with("warning: the views' axes through the ball miss it by ");
  }));
}

TEST_F(BallLampsTest, StopWhenAskedTo) {
  write();
  EXPECT_THROW(found({{}, [] { return true; }}), Cancelled);
}

} // namespace
} // namespace surflect::importers
