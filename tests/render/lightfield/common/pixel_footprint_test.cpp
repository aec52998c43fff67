#include "render/lightfield/common/pixel_footprint.h"

#include "tests/support/box_capture.h"

#include <gtest/gtest.h>

#include <vector>

namespace surflect::lightfield {
namespace {

TEST(PixelFootprint, IsDistanceOverFocalLengthInFrontOfAFace) {
  const auto camera = studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, 100); // at distance 4
  TriangleMesh square{{{-0.01f, -0.01f, 1}, {0.01f, -0.01f, 1}, {0.01f, 0.01f, 1}}, {{0, 1, 2}}};
  EXPECT_NEAR(pixelFootprint(square, std::vector{camera}), 3 / camera.lens.focalX, 1e-5 * 3);
}

TEST(PixelFootprint, OfAnOrthographicCameraIsItsScale) {
  auto camera = studio::cameraFrom<AcquisitionSpace>({0, 0, 1}, 100);
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.lens.focalX = camera.lens.focalY = 20;
  EXPECT_DOUBLE_EQ(pixelFootprint(boxes::unitCube(), std::vector{camera}), 1 / 20.0);
}

TEST(PixelFootprint, WithoutCamerasInFrontIsZero) {
  const auto behind = studio::cameraFrom<AcquisitionSpace>({0, 0, -1}, 100);
  TriangleMesh square{{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}}, {{0, 1, 2}}};
  EXPECT_EQ(pixelFootprint(square, std::vector{behind}), 0);
  EXPECT_EQ(pixelFootprint(square, {}), 0);
}

} // namespace
} // namespace surflect::lightfield
