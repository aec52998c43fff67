#include "render/film/standard_attributes.h"

#include "render/film/video.h"
#include "tests/srf/image/files.h"

#include <Eigen/Geometry>
#include <ImfFramesPerSecond.h>
#include <ImfInputFile.h>
#include <ImfStandardAttributes.h>

namespace surflect::film {
namespace {

using Camera = capture::Camera<ObjectSpace>;

Imath::M44f asImath(const image::RowMatrix& rows) {
  Imath::M44f matrix;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      matrix[row][column] = rows[static_cast<size_t>(row)][static_cast<size_t>(column)];
  return matrix;
}

Camera randomCamera(std::mt19937& random, capture::Lens::Model model) {
  std::uniform_real_distribution<double> any(-1, 1);
  capture::Lens lens;
  lens.model = model;
  lens.width = 640, lens.height = 480;
  lens.focalX = 500 + 200 * any(random), lens.focalY = 500 + 200 * any(random);
  lens.centerX = 320 + 50 * any(random), lens.centerY = 240 + 50 * any(random);
  const Mat3<double> rotation =
      Eigen::Quaterniond(any(random), any(random), any(random), any(random)).normalized().toRotationMatrix();
  return {lens, {rotation, Vec3<double>(any(random), any(random), any(random) - 4)}};
}

// A point that lies ahead of the camera.
Point3<ObjectSpace, double> randomPoint(std::mt19937& random, const Camera& camera) {
  std::uniform_real_distribution<double> any(-1, 1);
  return camera.cameraFromWorld.inverse()(
      Point3<CameraSpace, double>(any(random), any(random), -4 + any(random)));
}

TEST(StandardAttributes, WorldToNdcProjectsAsTheCameraDoes) {
  std::mt19937 random(1);
  double largest = 0; // pixels
  for (int i = 0; i < 1000; ++i) {
    const Camera camera =
        randomCamera(random, i % 2 ? capture::Lens::Model::pinhole : capture::Lens::Model::orthographic);
    const auto point = randomPoint(random, camera);
    const capture::Pixel pixel = camera.project(point).value();
    const Imath::V3f ndc = Imath::V3f(static_cast<float>(point.x()), static_cast<float>(point.y()),
                                      static_cast<float>(point.z())) *
                           asImath(worldToNdc(camera).value()); // Imath divides by the fourth number
    largest = std::max({largest, std::abs(ndc.x * 640 - pixel.x), std::abs(ndc.y * 480 - pixel.y)});
  }
  RecordProperty("largest_pixels", std::to_string(largest));
  EXPECT_LT(largest, 2.4e-4);
}

TEST(StandardAttributes, WorldToCameraHasXRightYUpAndZAhead) {
  const Mat3<double> rotation = Eigen::AngleAxisd(0.7, Vec3<double>(1, 2, 3).normalized()).toRotationMatrix();
  Camera camera;
  camera.cameraFromWorld = {rotation, Vec3<double>(1, 2, 3)};
  const auto point = camera.cameraFromWorld.inverse()(Point3<CameraSpace, double>(0.5, -0.25, -2));
  const Imath::V3f seen = Imath::V3f(static_cast<float>(point.x()), static_cast<float>(point.y()),
                                     static_cast<float>(point.z())) *
                          asImath(worldToCamera(camera));
  EXPECT_LT((seen - Imath::V3f(0.5f, -0.25f, 2)).length(), 1e-6f);
  EXPECT_LT(asImath(worldToCamera(camera)).determinant(), 0); // left-handed
}

TEST(StandardAttributes, DepthGrowsAlongNdcsZ) {
  std::mt19937 random(2);
  for (const auto model : {capture::Lens::Model::pinhole, capture::Lens::Model::orthographic}) {
    const Camera camera = randomCamera(random, model);
    float before = -1e9f;
    for (const double depth : {1.0, 2.0, 4.0, 8.0}) {
      const auto point = camera.cameraFromWorld.inverse()(Point3<CameraSpace, double>(0.1, 0.2, -depth));
      const float z = (Imath::V3f(static_cast<float>(point.x()), static_cast<float>(point.y()),
                                  static_cast<float>(point.z())) *
                       asImath(worldToNdc(camera).value()))
                          .z;
      EXPECT_GT(z, before + 0.05f);
      EXPECT_NEAR(z, model == capture::Lens::Model::pinhole ? 1 - 1 / depth : depth, 1e-5);
      before = z;
    }
  }
}

TEST(StandardAttributes, ADistortedPictureHasNoMatrixToNdc) {
  std::mt19937 random(3);
  Camera camera = randomCamera(random, capture::Lens::Model::pinhole);
  camera.lens.k1 = 0.1;
  EXPECT_FALSE(worldToNdc(camera));
}

TEST(StandardAttributes, AreThoseOfTheOpenExrLibrary) {
  const image::TemporaryFolder folder;
  Camera camera;
  camera.lens.width = 4, camera.lens.height = 2;
  camera.lens.focalX = camera.lens.focalY = 8;
  camera.lens.centerX = 2, camera.lens.centerY = 1;
  scene::Script script;
  script.frames = scene::Frames{1, 9, 23.976};
  script.output = scene::Output{.width = 4, .height = 2, .owner = "Somebody"};
  const image::Image picture(4, 2, 3);
  const image::ExrLayer layer{{"R", "G", "B"}, &picture};
  image::writeExr(folder / "a.exr", std::span(&layer, 1), standardAttributes(camera, script, 7));
  const Imf::InputFile file((folder / "a.exr").c_str());
  const Imf::Header& header = file.header();
  EXPECT_EQ(Imf::worldToCamera(header), asImath(worldToCamera(camera)));
  EXPECT_EQ(Imf::worldToNDC(header), asImath(worldToNdc(camera).value()));
  EXPECT_EQ(Imf::framesPerSecond(header).n, Imf::fps_23_976().n);
  EXPECT_EQ(Imf::framesPerSecond(header).d, Imf::fps_23_976().d);
  EXPECT_EQ(Imf::owner(header), "Somebody");
  EXPECT_EQ(header.screenWindowWidth(), 0.5f);
  EXPECT_TRUE(Imf::hasChromaticities(header));
}

TEST(StandardAttributes, RoundedRatesAreThoseOfVideo) {
  const image::TemporaryFolder folder;
  const image::Image picture(4, 2, 3);
  const image::ExrLayer layer{{"R", "G", "B"}, &picture};
  for (const auto& [rate, n, d] : {std::tuple{23.976, 24000, 1001u},
                                   {23.98, 24000, 1001u},
                                   {59.94, 60000, 1001u},
                                   {25.0, 25, 1u},
                                   {12.5, 25, 2u}}) {
    image::writeExr(folder / "a.exr", std::span(&layer, 1), {{"framesPerSecond", frameRate(rate)}});
    const Imf::InputFile file((folder / "a.exr").c_str());
    EXPECT_EQ(Imf::framesPerSecond(file.header()).n, n);
    EXPECT_EQ(Imf::framesPerSecond(file.header()).d, d);
  }
}

// The screen window of OpenEXR [ImfHeader.h; TechnicalIntroduction, "Perspective"]: at depth 1 it is `width`
// wide around `center`, y up, and as high as its pixels make it.
TEST(StandardAttributes, TheScreenWindowProjectsAsTheCameraDoes) {
  std::mt19937 random(4);
  const image::TemporaryFolder folder;
  scene::Script script;
  script.frames = scene::Frames{1, 9, 24};
  script.output = scene::Output{.width = 640, .height = 480};
  double largest = 0; // pixels
  for (int i = 0; i < 20; ++i) {
    const Camera camera = randomCamera(random, capture::Lens::Model::pinhole);
    const image::Image picture(640, 480, 1);
    const image::ExrLayer layer{{"Y"}, &picture};
    image::writeExr(folder / "a.exr", std::span(&layer, 1), standardAttributes(camera, script, 1));
    const Imf::InputFile file((folder / "a.exr").c_str());
    const Imf::Header& header = file.header();
    const double width = header.screenWindowWidth();
    const double height = width / header.pixelAspectRatio() * 480 / 640;
    for (int k = 0; k < 20; ++k) {
      const auto point = randomPoint(random, camera);
      const capture::Pixel pixel = camera.project(point).value();
      const auto seen = camera.cameraFromWorld(point);
      const double x = seen.x() / -seen.z() - header.screenWindowCenter().x;
      const double y = seen.y() / -seen.z() - header.screenWindowCenter().y;
      largest = std::max({largest, std::abs((0.5 + x / width) * 640 - pixel.x),
                          std::abs((0.5 - y / height) * 480 - pixel.y)});
    }
  }
  RecordProperty("largest_pixels", std::to_string(largest));
  EXPECT_LT(largest, 2e-4);
}

} // namespace
} // namespace surflect::film
