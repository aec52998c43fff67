#include "bench/quality/traced_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace surflect::bench {
namespace {

constexpr const char* kBall = R"(
samples = 16
[camera]
model = "pinhole"
size = [156, 124]
distance = 5
fov_deg = 27
[views]
count = 3
[lights]
count = 4
test = 2
irradiance = [3, 3, 3]
[[material]]
name = "clay"
type = "lambert"
albedo = [0.8, 0.35, 0.2]
[[object]]
type = "sphere"
material = "clay"
center = [0.2, 0, 0.1]
radius = 0.7
segments = 64
)";

size_t texelsOf(const image::Image& alpha) {
  return static_cast<size_t>(std::ranges::count_if(alpha.values, [](float a) { return a >= 0.5f; }));
}

struct Total {
  size_t texels = 0;
  double green = 0; // under the first light
};
Total total(const codec::ReflectanceStack& stack) {
  Total sum{texelsOf(stack.alpha), 0};
  for (size_t i = 0; i < stack.alpha.values.size(); ++i)
    if (stack.alpha.values[i] >= 0.5f) sum.green += stack.lights[0].values[3 * i + 1];
  return sum;
}

TEST(TracedBlocks, AllOfThemAreThePictures) {
  const stage::Stage stage = stage::parseStage(kBall, "ball.toml");
  const auto blocks = traceBlocks(stage, {.views = 3, .every = 1});
  ASSERT_EQ(blocks.size(), 3u);
  const stage::StageScene scene(stage.objects);
  const std::vector<capture::Light> lights(stage.rig.lights.begin(), stage.rig.lights.begin() + 4);
  for (size_t view = 0; view < 3; ++view) {
    ASSERT_EQ(blocks[view].lights.size(), 4u); // none for the test
    const stage::TracedView traced =
        stage::traceView(scene, stage.rig.views[view].camera, view, lights, stage.trace, {});
    const Total whole = total({156, 124, traced.radiance, traced.alpha}), parts = total(blocks[view]);
    EXPECT_NEAR(static_cast<double>(parts.texels), static_cast<double>(whole.texels),
                0.01 * static_cast<double>(whole.texels));
    EXPECT_NEAR(parts.green, whole.green, 0.02 * whole.green + 1);
  }
}

TEST(TracedBlocks, EveryFifthIsAFifthOfTheObject) {
  const stage::Stage stage = stage::parseStage(kBall, "ball.toml");
  size_t all = 0, some = 0;
  for (const auto& stack : traceBlocks(stage, {.views = 3, .every = 1})) all += texelsOf(stack.alpha);
  for (const auto& stack : traceBlocks(stage, {.views = 3, .every = 5})) some += texelsOf(stack.alpha);
  EXPECT_NEAR(static_cast<double>(some), static_cast<double>(all) / 5, 0.15 * static_cast<double>(all) / 5);
}

// What lies in a block is one piece of the ball, not a mixture: neighbours in it differ little.
TEST(TracedBlocks, AreWholeBlocks) {
  stage::Stage stage = stage::parseStage(kBall, "ball.toml");
  stage.trace.samples = 64;
  const codec::ReflectanceStack stack = traceBlocks(stage, {.views = 1, .every = 3})[0];
  EXPECT_EQ(stack.width % codec::blockSize, 0);
  for (const image::Image& light : stack.lights)
    for (int y = 0; y < stack.height; ++y)
      for (int x = 0; x < stack.width; ++x) {
        if (x % codec::blockSize == 0 || stack.alpha.at(x, y)[0] < 1 || stack.alpha.at(x - 1, y)[0] < 1)
          continue;
        ASSERT_NEAR(light.at(x, y)[1], light.at(x - 1, y)[1], 0.06) << x << ", " << y;
      }
}

TEST(TracedBlocks, AreTheSameEachTime) {
  const stage::Stage stage = stage::parseStage(kBall, "ball.toml");
  const auto once = traceBlocks(stage, {.views = 2, .every = 4}),
             again = traceBlocks(stage, {.views = 2, .every = 4});
  for (size_t view = 0; view < 2; ++view) {
    EXPECT_EQ(once[view].alpha.values, again[view].alpha.values);
    EXPECT_EQ(once[view].lights[3].values, again[view].lights[3].values);
  }
}

} // namespace
} // namespace surflect::bench
