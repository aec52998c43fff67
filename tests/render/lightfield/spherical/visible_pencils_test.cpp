#include "render/lightfield/spherical/visible_pencils.h"

#include "surfel/base/error.h"
#include "tests/render/lightfield/spherical/synthetic_field.h"

#include <algorithm>
#include <random>
#include <set>

namespace surflect::spherical {
namespace {

const Sphere kSphere{Vec3<double>::Zero(), 1};

TEST(VisiblePencils, AreThoseThatSomePixelShows) {
  const DirectionTree tree(4);
  std::mt19937 random(2);
  for (int i = 0; i < 5; ++i) {
    const auto camera = cameraAt(4 * randomUnit(random), 400, 50);
    const Window window = wholeWindow(windowOf(camera, kSphere));
    for (size_t level = 0; level < 4; ++level) {
      std::set<uint32_t> visible, shown;
      for (const Pencil& pencil : visiblePencils(tree, level, window)) visible.insert(pencil.index);
      const auto worldFromCamera = camera.cameraFromWorld.inverse();
      for (int y = 0; y <= 400; ++y)
        for (int x = 0; x <= 400; ++x) {
          const auto ray = capture::rayThrough(camera.lens, {double(x), double(y)});
          shown.insert(tree.find(level, -worldFromCamera(ray->direction).raw()).index);
        }
      EXPECT_TRUE(std::ranges::includes(visible, shown));
      EXPECT_LE(visible.size(), shown.size() + 2); // pencils of which less than a pixel is seen
    }
  }
}

// The paper's p gives 107 and 427.
TEST(VisiblePencils, AreCountedAndEstimatedAlikeForAWindowOf60Degrees) {
  const DirectionTree tree(5);
  std::mt19937 random(3);
  for (const auto& [level, expected] : {std::pair{size_t{3}, 131.0}, {size_t{4}, 467.0}}) {
    double counted = 0;
    constexpr int kTimes = 200;
    Window window;
    for (int i = 0; i < kTimes; ++i) {
      window = wholeWindow(windowOf(cameraAt(4 * randomUnit(random), 100, 60), kSphere));
      counted += static_cast<double>(visiblePencils(tree, level, window).size()) / kTimes;
    }
    EXPECT_NEAR(estimatedPencils(level, window), expected, 1);
    EXPECT_NEAR(counted, expected, 0.02 * expected);
  }
}

TEST(VisiblePencils, LeaveOutThoseWhoseImagesTheViewerCannotSee) {
  const DirectionTree tree(4);
  const auto camera = cameraAt({0, 0, 10}, 400, 90);
  const Window window = windowOf(camera, kSphere);
  const auto visible = visiblePencils(tree, 3, window);
  EXPECT_LT(visible.size(), 30u);
  for (int y = 0; y < 400; ++y)
    for (int x = 0; x < 400; ++x) {
      const Vec3<double> direction =
          camera.cameraFromWorld.inverse()(capture::rayThrough(camera.lens, {x + 0.5, y + 0.5})->direction)
              .raw();
      if (camera.center().raw().cross(direction).norm() >= 1) continue; // passes the sphere by
      EXPECT_NE(std::ranges::find(visible, tree.find(3, -direction)), visible.end());
    }
}

TEST(VisiblePencils, AreAllThoseOfTheWindowInsideTheSphere) {
  const auto camera = cameraAt({0, 0, 0.5}, 400, 90);
  EXPECT_GT(windowOf(camera, kSphere).angle, 3.2);
}

TEST(VisiblePencils, OtherLensesAreRefused) {
  auto camera = cameraAt({0, 0, 5}, 100);
  camera.lens.k1 = 0.1;
  EXPECT_THROW(windowOf(camera, kSphere), Error);
  camera.lens.k1 = 0;
  camera.lens.model = capture::Lens::Model::orthographic;
  EXPECT_THROW(windowOf(camera, kSphere), Error);
}

} // namespace
} // namespace surflect::spherical
