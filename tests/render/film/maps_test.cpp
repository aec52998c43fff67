#include "render/film/maps.h"

#include "srf/image/color.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

#include <Eigen/Geometry>

namespace surflect::film {
namespace {

double sampleAt(const image::PngSamples& map, int pixel, int channel) {
  const size_t at = 2 * static_cast<size_t>(pixel * map.channels + channel);
  return (256 * map.bytes[at] + map.bytes[at + 1]) / 65535.0;
}

// A row of pixels: off the object, opaque, half covered.
image::Image coverage() {
  image::Image color(3, 1, 4);
  color.values = {0, 0, 0, 0, 0.2f, 0.4f, 1.5f, 1, 0.1f, 0.2f, 0, 0.5f};
  return color;
}

TEST(Maps, NormalsAreInCameraAxesAndUnpremultiplied) {
  const Mat3<double> rotation = Eigen::AngleAxisd(0.8, Vec3<double>(3, 1, 2).normalized()).toRotationMatrix();
  capture::Camera<ObjectSpace> camera;
  camera.cameraFromWorld = {rotation, Vec3<double>(1, 2, -9)};
  const Vec3<double> inCamera = Vec3<double>(0.3, -0.5, 0.8).normalized(),
                     inWorld = rotation.transpose() * inCamera;
  image::Image normals(3, 1, 3);
  for (int axis = 0; axis < 3; ++axis) {
    normals.at(1, 0)[static_cast<size_t>(axis)] = static_cast<float>(inWorld[axis]);
    normals.at(2, 0)[static_cast<size_t>(axis)] = static_cast<float>(0.5 * inWorld[axis]);
  }
  const image::PngSamples map = normalMap(coverage(), normals, camera);
  EXPECT_EQ(map.channels, 4);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(2 * sampleAt(map, 0, axis) - 1, axis == 2 ? 1 : 0, 2.0 / 65535) << "off the object";
    for (const int pixel : {1, 2})
      EXPECT_NEAR(2 * sampleAt(map, pixel, axis) - 1, inCamera[axis], 2.0 / 65535);
  }
  for (const auto& [pixel, alpha] : {std::pair(0, 0.0), {1, 1.0}, {2, 0.5}})
    EXPECT_NEAR(sampleAt(map, pixel, 3), alpha, 1.0 / 65535);
}

TEST(Maps, HeightsAreLinearBetweenTheStatedOnes) {
  capture::Camera<ObjectSpace> camera; // looks along -z from the origin
  const HeightRange range{Point3<ObjectSpace, double>(0.3, -0.2, -10), 2};
  image::Image depth(3, 1, 1);
  depth.values = {std::numeric_limits<float>::infinity(), 9, 11.5f};
  const HeightMap heights = heightMap(coverage(), depth, range, camera);
  const image::PngSamples& map = heights.samples;
  EXPECT_EQ(map.texts, (std::vector<std::pair<std::string, std::string>>{{"height of black", "-2"},
                                                                         {"height of white", "2"}}));
  EXPECT_EQ(sampleAt(map, 0, 0), 0);
  EXPECT_EQ(sampleAt(map, 0, 1), 0);
  EXPECT_NEAR(sampleAt(map, 1, 0), 0.75, 0.6 / 65535); // one unit before the middle: brighter
  EXPECT_NEAR(sampleAt(map, 2, 0), 0.125, 0.6 / 65535);
  EXPECT_NEAR(sampleAt(map, 2, 1), 0.5, 0.6 / 65535);
  EXPECT_EQ(heights.farthest, -1.5) << "that of the third pixel";
}

TEST(Maps, AlbedoIsStraightAndInSrgb) {
  const image::PngSamples map = albedoMap(coverage());
  EXPECT_EQ(map.colors, image::PngColors::srgb);
  for (const int pixel : {1, 2})
    for (const auto& [channel, albedo] : {std::pair(0, 0.2f), {1, 0.4f}})
      EXPECT_NEAR(sampleAt(map, pixel, channel), image::srgbFromLinear(albedo), 0.6 / 65535);
  EXPECT_EQ(sampleAt(map, 1, 2), 1); // clipped
  EXPECT_EQ(sampleAt(map, 0, 3), 0);
}

TEST(Maps, ReadBackWithTheirTexts) {
  const image::TemporaryFolder folder;
  image::PngSamples map = albedoMap(coverage());
  map.texts = {{"height of black", "-2"}};
  const std::string bytes = image::pngBytes(map);
  EXPECT_NE(bytes.find(std::string("tEXtheight of black\0-2", 22)), std::string::npos);
  writeFileAtomically(folder / "a.png", bytes);
  const image::PngPicture picture = image::readPng(folder / "a.png");
  EXPECT_EQ(picture.bitDepth, 16);
  for (int pixel = 0; pixel < 3; ++pixel)
    for (int channel = 0; channel < 4; ++channel)
      EXPECT_NEAR(picture.image.at(pixel, 0)[static_cast<size_t>(channel)], sampleAt(map, pixel, channel),
                  1e-7);
}

} // namespace
} // namespace surflect::film
