#include "render/gl/projection.h"

#include "tests/render/clouds.h"
#include "tests/render/gl/gl_test.h"

#include <cmath>

namespace surflect::gl {
namespace {

class ProjectionTest : public GlTest {};

using Camera = capture::Camera<ObjectSpace>;

// A camera around the unit box, with a principal point off the middle and pixels that are not square.
Camera randomCamera(Rng& rng) {
  const Eigen::Vector3d eye =
      3 * Eigen::Vector3f(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, 0.5f, 1))
              .normalized()
              .cast<double>();
  Camera camera = testing::lookAt(eye, {0, 0, 0}, 80, 60, 70);
  camera.lens.focalY = uniform(rng, 50, 90);
  camera.lens.centerX += uniform(rng, -20, 20);
  camera.lens.centerY += uniform(rng, -20, 20);
  return camera;
}

const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1));

Point3<ObjectSpace> randomPoint(Rng& rng) {
  const float x = uniform(rng, -1, 1), y = uniform(rng, -1, 1);
  return {x, y, uniform(rng, -1, 1)};
}

TEST(ClipFromWorld, AgreesWithTheCamera) {
  Rng rng(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Camera camera = randomCamera(rng);
    const auto p = randomPoint(rng);
    const auto pixel = camera.project(p.cast<double>());
    const Eigen::Vector4f clip = clipFromWorld(camera, kBox) * p.raw().homogeneous();
    const Eigen::Vector3f ndc = clip.hnormalized();
    ASSERT_TRUE(pixel);
    EXPECT_NEAR((ndc.x() + 1) / 2 * 80, pixel->x, 2e-4);
    EXPECT_NEAR((1 - ndc.y()) / 2 * 60, pixel->y, 2e-4);
    EXPECT_GT(ndc.z(), 0);
    EXPECT_LT(ndc.z(), 1);
  }
}

TEST(ClipFromWorld, KeepsWhatIsInFrontOfACameraInsideTheBox) {
  const Camera camera = testing::lookAt({0, 0, 0.5}, {0, 0, 0}, 80, 60, 70);
  const auto depthOf = [&](float z) {
    return (clipFromWorld(camera, kBox) * Eigen::Vector4f(0, 0, z, 1)).hnormalized().z();
  };
  EXPECT_GT(depthOf(0.499f), 0);
  EXPECT_LT(depthOf(-1), 1);
  EXPECT_LT(depthOf(0), depthOf(-0.5));
}

TEST(ClipFromWorld, IsFiniteForABoxBehindTheCameraAndForAnEmptyOne) {
  const Camera camera = testing::lookAt({0, 0, 3}, {0, 0, 6}, 80, 60, 70);
  EXPECT_TRUE(clipFromWorld(camera, kBox).allFinite());
  EXPECT_TRUE(clipFromWorld(camera, Eigen::AlignedBox3d()).allFinite());
}

TEST(ClipFromWorld, RefusesLensesThatTrianglesCannotFollow) {
  Camera camera = testing::lookAt({0, 0, 3}, {0, 0, 0}, 80, 60, 70);
  camera.lens.k1 = 0.1;
  EXPECT_EQ(image::errorOf([&] { clipFromWorld(camera, kBox); }),
            "lens: found distortion, expected none: OpenGL draws straight lines");
  camera.lens = {};
  camera.lens.model = capture::Lens::Model::orthographic;
  EXPECT_EQ(image::errorOf([&] { clipFromWorld(camera, kBox); }),
            "lens.model: found orthographic, expected pinhole");
}

TEST_F(ProjectionTest, APointIsDrawnAtItsPixel) {
  Rng rng(2);
  const Texture color({Format::r32f, 80, 60});
  Framebuffer target("target", {{&color}});
  int drawn = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Camera camera = randomCamera(rng);
    const auto p = randomPoint(rng);
    const capture::Pixel pixel = *camera.project(p.cast<double>());
    // Drivers place points on a grid, at least 16 to a pixel.
    const auto nearBorder = [](double x) { return std::abs(x - std::round(x)) < 1. / 16; };
    if (nearBorder(pixel.x) || nearBorder(pixel.y) || !capture::contains(camera.lens, pixel)) continue;
    target.clearColor(0, {0, 0, 0, 0});
    const VertexAttribute attribute{0, 3, std::as_bytes(std::span(&p, 1))};
    draw({target, colorProgram({1, 1, 1, 1}, clipFromWorld(camera, kBox))}, VertexArray({&attribute, 1}),
         Primitive::points);
    image::Image expected(80, 60, 1);
    expected.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y))[0] = 1;
    EXPECT_EQ(color.read().values, expected.values) << pixel.x << " " << pixel.y;
    ++drawn;
  }
  EXPECT_GT(drawn, 100);
}

} // namespace
} // namespace surflect::gl
