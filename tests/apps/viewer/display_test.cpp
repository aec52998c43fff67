#include "apps/viewer/display.h"

#include "surfel/base/error.h"
#include "tests/support/pictures.h"

#include <gtest/gtest.h>

#include <limits>

namespace surflect::viewer {
namespace {

using testing::colors;

std::array<int, 3> pixelOf(const DisplayPicture& picture, size_t i) {
  return {picture.bytes[3 * i], picture.bytes[3 * i + 1], picture.bytes[3 * i + 2]};
}
using Bytes = std::array<int, 3>;

method::FrameLayers layersOf(const std::string& aov, int channels, std::vector<float> values) {
  method::FrameLayers layers;
  const auto count = values.size() / static_cast<size_t>(channels);
  layers.color = image::Image(static_cast<int>(count), 1, 4);
  for (size_t i = 0; i < count; ++i) layers.color.values[4 * i + 3] = 1;
  layers.aovs[aov] = image::Image(static_cast<int>(count), 1, channels);
  layers.aovs[aov].values = std::move(values);
  return layers;
}

TEST(Display, LayersHaveTheirColors) {
  const Point3<AcquisitionSpace, double> middle(1, 2, 3);
  const auto shown = [&](const std::string& aov, int channels, std::vector<float> values) {
    return shownAov(layersOf(aov, channels, std::move(values)), aov, middle, 2, {.white = 1});
  };
  EXPECT_EQ(pixelOf(shown("normal", 3, {0, 0, 1}), 0), (Bytes{128, 128, 255}));
  EXPECT_EQ(pixelOf(shown("position", 3, {1, 2, 3}), 0), (Bytes{128, 128, 128}));
  EXPECT_EQ(pixelOf(shown("rest", 3, {3, 2, 1}), 0), (Bytes{255, 128, 0}));
  EXPECT_EQ(pixelOf(shown("camera_blend", 3, {1, 0.5f, 0}), 0), (Bytes{255, 128, 0}));
  const DisplayPicture depth = shown("depth", 1, {2, 3, 4});
  EXPECT_EQ(pixelOf(depth, 0), (Bytes{255, 255, 255})); // the nearest
  EXPECT_EQ(pixelOf(depth, 1), (Bytes{140, 140, 140}));
  EXPECT_EQ(pixelOf(depth, 2), (Bytes{26, 26, 26}));
  EXPECT_EQ(pixelOf(shown("stretch", 1, {1}), 0), (Bytes{0, 0, 4}));
  EXPECT_EQ(pixelOf(shown("stretch", 1, {8}), 0), (Bytes{252, 253, 191}));
  EXPECT_EQ(pixelOf(shown("predicted_error", 1, {0.25f}), 0), (Bytes{252, 253, 191}));
  EXPECT_THROW(shownAov(layersOf("depth", 1, {1}), "normal", middle, 1, {}), Error);
}

TEST(Display, ALayerShowsTheBackgroundOffTheObject) {
  method::FrameLayers layers = layersOf("depth", 1, {std::numeric_limits<float>::infinity(), 1, 2});
  layers.color.values[3] = 0;
  const DisplayPicture shown = shownAov(layers, "depth", {0, 0, 0}, 1, {.background = {0, 1, 0}});
  EXPECT_EQ(pixelOf(shown, 0), (Bytes{0, 255, 0}));
  EXPECT_EQ(pixelOf(shown, 1), (Bytes{255, 255, 255}));
}

TEST(Display, AnErrorOfAQuarterOfWhiteIsLightest) {
  const image::Image truth = colors({{0.5f, 0.5f, 0.5f, 1}, {0.5f, 0.5f, 0.5f, 1}, {0, 0, 0, 0}});
  const image::Image other = colors({{0.5f, 0.5f, 0.5f, 1}, {0.5f, 1, 0.5f, 1}, {0, 0, 0, 0}});
  const DisplayPicture shown = shownError(truth, other, {.white = 2, .background = {0, 0, 1}});
  EXPECT_EQ(pixelOf(shown, 0), (Bytes{0, 0, 4}));
  EXPECT_EQ(pixelOf(shown, 1), (Bytes{252, 253, 191}));
  EXPECT_EQ(pixelOf(shown, 2), (Bytes{0, 0, 255}));
}

TEST(Display, JpegKeepsFlatColors) {
  DisplayPicture picture{64, 48, std::vector<uint8_t>(3 * 64 * 48, 200), 3};
  for (const JpegQuality quality : {JpegQuality::moving, JpegQuality::still}) {
    const std::string bytes = jpegBytes(picture, quality);
    EXPECT_TRUE(bytes.starts_with("\xff\xd8"));
    EXPECT_TRUE(bytes.ends_with("\xff\xd9"));
  }
  EXPECT_THROW(jpegBytes({0, 0, {}}, JpegQuality::still), Error);
}

} // namespace
} // namespace surflect::viewer
