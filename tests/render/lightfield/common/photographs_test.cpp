#include "render/lightfield/common/photographs.h"

#include "tests/support/synthetic_capture.h"

#include <array>

namespace surflect::lightfield {
namespace {

class PhotographsTest : public ::testing::Test {
protected:
  PhotographsTest() {
    studio::photograph({.cameras = 5, .lights = 0, .size = 24}, folder_.path());
    views_.emplace(folder_.path());
  }
  image::TemporaryFolder folder_;
  std::optional<Views> views_;
};

TEST_F(PhotographsTest, AtPixelCentresAreThePictures) {
  constexpr std::array<size_t, 2> kIndices{3, 1};
  const Photographs photographs(*views_, kIndices);
  ASSERT_EQ(photographs.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    const image::Image picture = views_->read(kIndices[i]);
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        const Eigen::Vector4f found = photographs.at(i, {x + 0.5, y + 0.5});
        for (int channel = 0; channel < 4; ++channel)
          EXPECT_NEAR(found[channel], picture.at(x, y)[channel], 0.0005f * picture.at(x, y)[channel]);
      }
  }
}

TEST_F(PhotographsTest, BetweenPixelCentresAreMeans) {
  const Photographs photographs(*views_, std::array<size_t, 1>{0});
  const auto at = [&](double x, double y) { return photographs.at(0, {x, y}); };
  for (int y = 1; y < 23; ++y)
    for (int x = 1; x < 23; ++x) {
      const Eigen::Vector4f mean =
          (at(x - 0.5, y - 0.5) + at(x + 0.5, y - 0.5) + at(x - 0.5, y + 0.5) + at(x + 0.5, y + 0.5)) / 4;
      EXPECT_LE((at(x, y) - mean).norm(), 1e-6f);
    }
}

TEST_F(PhotographsTest, BeyondTheBorderAreConstant) {
  const Photographs photographs(*views_, std::array<size_t, 1>{0});
  EXPECT_EQ(photographs.at(0, {-100, 12}), photographs.at(0, {0.5, 12}));
  EXPECT_EQ(photographs.at(0, {12, 1e9}), photographs.at(0, {12, 23.5}));
}

} // namespace
} // namespace surflect::lightfield
