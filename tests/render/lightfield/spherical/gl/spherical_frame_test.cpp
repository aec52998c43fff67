#include "render/lightfield/spherical/spherical_frame.h"

#include "render/lightfield/spherical/player.h"
#include "render/lightfield/spherical/reference.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/spherical/synthetic_field.h"

#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace surflect::spherical {
namespace {

class SphericalFrameTest : public gl::GlTest {
protected:
  static void SetUpTestSuite() {
    gl::GlTest::SetUpTestSuite();
    field_ = std::make_unique<SyntheticField>(4, 64);
  }
  static void TearDownTestSuite() {
    field_.reset();
    gl::GlTest::TearDownTestSuite();
  }
  void SetUp() override {
    frame_ =
        std::make_unique<SphericalFrame>(field_->tree, field_->shape, field_->shape.images(), field_->mesh);
    for (uint32_t image = 0; image < field_->shape.images(); ++image)
      frame_->upload(image, field_->images[image]);
  }
  void TearDown() override {
    frame_.reset();
    gl::GlTest::TearDown();
  }

  Picture rendered(const capture::Camera<AcquisitionSpace>& camera, const Look& look, int samples = 1) {
    const FramePlan plan = planFrame(field_->tree, windowOf(camera, field_->shape.sphere), look);
    std::vector<TexturedTriangle> triangles;
    for (const WeightedTriangle& triangle : plan.triangles)
      triangles.push_back({triangle, imageOf(triangle.pencil), imageOf(triangle.pencil)});
    frame_->begin(camera, look, samples);
    frame_->add(triangles);
    return frame_->read(true);
  }
  static Picture reference(const capture::Camera<AcquisitionSpace>& camera, const Look& look) {
    return renderReference(
        field_->tree, field_->shape, [](const Pencil& pencil) { return field_->shown(pencil); }, camera, look,
        field_->rays);
  }

  static inline std::unique_ptr<SyntheticField> field_;
  std::unique_ptr<SphericalFrame> frame_;
};

std::vector<Look> allLooks() {
  std::vector<Look> looks;
  for (const double detail : {0.0, 2.0, 2 + 1.0 / 3, 3.0})
    for (const bool depth : {false, true})
      for (const bool interpolated : {false, true}) looks.push_back({detail, 0, depth, interpolated});
  looks.push_back({1.5, 1.25, true, true});
  looks.push_back({1.5, 0, true, true, 1});
  return looks;
}

TEST_F(SphericalFrameTest, AgreesWithTheReference) {
  std::mt19937 random(7);
  for (const Look& look : allLooks()) {
    const auto camera = cameraAt((3 + 0.02 * static_cast<double>(random() % 100)) * randomUnit(random), 96);
    EXPECT_GT(decibels(rendered(camera, look).color, reference(camera, look).color), 46)
        << look.detail << " depth " << look.depth << " interpolated " << look.interpolated;
  }
}

// Whatever the texels of images are.
TEST_F(SphericalFrameTest, OutlinesAndDepthsAreThoseOfTheMesh) {
  std::mt19937 random(12);
  for (const double detail : {0.0, 1.5, 3.0}) {
    const auto camera = cameraAt(3.5 * randomUnit(random), 96);
    const Picture found = rendered(camera, {detail, 0, true, true});
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    size_t covered = 0, wrong = 0, far = 0;
    for (int y = 0; y < 96; ++y)
      for (int x = 0; x < 96; ++x) {
        const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        const auto hit = field_->rays.firstHit(camera.center(), worldFromCamera(ray->direction));
        covered += hit.has_value();
        const float alpha = found.color.at(x, y)[3], depth = found.depth.at(x, y)[0];
        wrong += hit.has_value() != (alpha > 0);
        far += hit && !(std::abs(depth - hit->distance * -ray->direction.z()) < 1e-3);
      }
    EXPECT_GT(covered, 1000u);
    EXPECT_LE(wrong, 4u) << detail; // on the outline, where the rasteriser rounds corners
    EXPECT_LE(far, 8u) << detail;   // on inner outlines
  }
}

TEST_F(SphericalFrameTest, NothingBehindTheViewerIsShown) {
  std::mt19937 random(9);
  size_t covered = 0;
  for (int trial = 0; trial < 20; ++trial) { // within the object's sphere and close to it
    const auto camera = cameraAt((0.2 + 0.06 * trial) * randomUnit(random), 32, 100);
    for (const Look& look : {Look{3, 0, true, true}, Look{0.5, 0, true, false}})
      for (const Picture& picture : {rendered(camera, look), reference(camera, look)})
        for (const float depth : picture.depth.values) {
          EXPECT_GT(depth, 0) << "trial " << trial;
          covered += std::isfinite(depth);
        }
  }
  EXPECT_GT(covered, 10000u);
}

// Not even the smallest mip levels, whose texels at the border are partly covered.
TEST_F(SphericalFrameTest, NothingIsShownWhereTheViewerLooksAway) {
  std::mt19937 random(10);
  for (int trial = 0; trial < 20; ++trial) {
    auto camera = cameraAt(1.4 * randomUnit(random), 16, 165);
    const Mat3<double> turned = Vec3<double>(-1, 1, -1).asDiagonal();
    camera.cameraFromWorld = {turned * camera.cameraFromWorld.rotation(),
                              turned * camera.cameraFromWorld.translation()};
    for (const Look& look : {Look{0, 5, true, true}, Look{0, 5, false, true}, Look{1, 4, true, false}})
      for (const Picture& picture : {rendered(camera, look), reference(camera, look)})
        for (const float value : picture.color.values) ASSERT_EQ(value, 0) << "trial " << trial;
  }
}

TEST_F(SphericalFrameTest, ShowsTheObjectBetterWithEachLevelWithDepthAndWithInterpolation) {
  std::mt19937 random(8);
  std::map<std::string, double> scores; // means
  for (int i = 0; i < 6; ++i) {
    const auto camera = cameraAt(3.5 * randomUnit(random), 96);
    const image::Image truth = field_->truth(camera);
    const auto add = [&](const std::string& name, const Look& look) {
      scores[name] += interiorDecibels(rendered(camera, look).color, truth) / 6;
    };
    for (const int level : {0, 1, 2, 3}) add(std::to_string(level), {double(level), 0, false, false});
    add("depth", {3, 0, true, false});
    add("interpolated", {3, 0, false, true});
    add("both", {3, 0, true, true});
  }
  for (const char* level : {"0", "1", "2"})
    EXPECT_GT(scores[std::string(1, static_cast<char>(level[0] + 1))], scores[level] + 2);
  EXPECT_GT(scores["depth"], scores["3"] + 3);
  EXPECT_GT(scores["interpolated"], scores["3"] + 0.5);
  EXPECT_GT(scores["both"], scores["3"] + 5);
  EXPECT_GT(scores["both"], 33);
}

// With weights that sum to 1, opaque stays opaque.
TEST_F(SphericalFrameTest, IsOpaqueWithinTheObjectAtEveryLevel) {
  const auto camera = cameraAt({0, 1, 3}, 64);
  for (const Look& look : allLooks()) {
    const Picture picture = rendered(camera, look);
    EXPECT_NEAR(picture.color.at(32, 32)[3], 1, 1e-3);
    EXPECT_EQ(picture.color.at(0, 0)[3], 0);
  }
}

TEST_F(SphericalFrameTest, DoesNotPop) {
  const auto camera = cameraAt({2, 1, 2.5}, 96);
  for (const double level : {0., 1., 2.}) {
    const auto largestChange = [](const image::Image& a, const image::Image& b) {
      double largest = 0;
      for (size_t i = 0; i < a.values.size(); ++i)
        largest = std::max(largest, std::abs(static_cast<double>(a.values[i] - b.values[i])));
      return largest;
    };
    constexpr int kSteps = 30;
    const image::Image first = rendered(camera, {level, 0, true, true}).color;
    image::Image before = first;
    double largest = 0;
    for (int step = 1; step <= kSteps; ++step) {
      const image::Image now = rendered(camera, {level + 1.0 * step / kSteps, 0, true, true}).color;
      largest = std::max(largest, largestChange(before, now));
      before = now;
    }
    EXPECT_LT(largest, largestChange(first, before) / 10) << "from level " << level;
  }
}

TEST_F(SphericalFrameTest, SamplesAreAveraged) {
  const auto camera = cameraAt({2, 1, 2.5}, 48);
  auto fine = camera;
  fine.lens = capture::resized(camera.lens, 96, 96);
  const Look look{3, 0, true, true};
  const image::Image averaged = rendered(camera, look, 2).color, whole = rendered(fine, look).color;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x) {
      float sum = 0;
      for (int i = 0; i < 4; ++i) sum += whole.at(2 * x + i % 2, 2 * y + i / 2)[0];
      EXPECT_NEAR(averaged.at(x, y)[0], sum / 4, 1e-5);
    }
}

} // namespace
} // namespace surflect::spherical
