#include "render/lightfield/lumigraph/lumigraph_frame.h"

#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/reference.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"

#include <cmath>

namespace surflect::lumigraph {
namespace {

class LumigraphFrameTest : public gl::GlTest {
protected:
  static image::Image rendered(LumigraphFrame& frame, const capture::Camera<AcquisitionSpace>& camera,
                               int samples = 1) {
    std::map<std::string, double> seconds;
    return frame.render(camera, samples, seconds);
  }
};

// Agreement of two pictures over the pixels that either covers, for a peak of 1.
struct Agreement {
  size_t covered = 0;
  size_t disputed = 0;   // differ by over 0.01: an outline passes through the pixel's centre
  double decibels = 0;   // of pixels that both cover
  double undisputed = 0; // of pixels that are not disputed, decibels
};
Agreement agreementOf(const image::Image& a, const image::Image& b) {
  Agreement agreement;
  double squares = 0, undisputed = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) {
      const auto p = a.at(x, y), q = b.at(x, y);
      if (p[3] == 0 && q[3] == 0) continue;
      ++agreement.covered;
      double square = 0, largest = 0;
      for (size_t channel = 0; channel < 4; ++channel) {
        const double difference = std::abs(static_cast<double>(p[channel]) - static_cast<double>(q[channel]));
        square += difference * difference;
        largest = std::max(largest, difference);
      }
      if (p[3] > 0 && q[3] > 0) squares += square;
      if (largest > 0.01)
        ++agreement.disputed;
      else
        undisputed += square;
    }
  const auto decibels = [&](double sum) {
    return -10 * std::log10(sum / (4 * static_cast<double>(agreement.covered)));
  };
  agreement.decibels = decibels(squares), agreement.undisputed = decibels(undisputed);
  return agreement;
}

TEST_F(LumigraphFrameTest, AgreesWithTheReferenceFrom20Cameras) {
  const TriangleMesh mesh = bumpySphere(0.4);
  for (const double overlap : {0., 0.2}) {
    const Lumigraph lumigraph =
        lumigraphFrom(mesh, {.nodes = 4, .texels = 150000, .overlap = overlap}, glossy);
    LumigraphFrame frame(lumigraph);
    const Reference reference(lumigraph);
    std::mt19937 random(1);
    for (int n = 0; n < 20; ++n) {
      const auto camera = randomCamera(random, 96);
      const Agreement agreement = agreementOf(rendered(frame, camera), reference.render(camera));
      EXPECT_GE(agreement.decibels, 51); // a pixel on an inner outline costs that much
      EXPECT_GE(agreement.undisputed, 118);
      EXPECT_GT(agreement.covered, 1000u);
      EXPECT_LE(static_cast<double>(agreement.disputed), 0.002 * static_cast<double>(agreement.covered));
    }
  }
}

TEST_F(LumigraphFrameTest, AgreesWithTheReferenceWhereTexelsTellTheOutline) {
  const TriangleMesh mesh = bumpySphere(0.4), coarse = bumpySphere(0.4, 12);
  Lumigraph lumigraph = lumigraphFrom(mesh, {.nodes = 4, .texels = 150000}, glossy);
  lumigraph.geometry = coarse;
  lumigraph.fringe = fringeAround(mesh, coarse);
  lumigraph.exactOutline = false;
  LumigraphFrame frame(lumigraph);
  const Reference reference(lumigraph);
  std::mt19937 random(2);
  for (int n = 0; n < 5; ++n) {
    const auto camera = randomCamera(random, 96);
    EXPECT_GE(agreementOf(rendered(frame, camera), reference.render(camera)).undisputed, 86);
  }
}

TEST_F(LumigraphFrameTest, AConstantObjectIsConstant) {
  const Lumigraph lumigraph =
      lumigraphFrom(bumpySphere(0.4), {.nodes = 3, .texels = 50000},
                    [](const Point&, const Direction&) { return Eigen::Vector3d(0.25, 2, 0.75); });
  LumigraphFrame frame(lumigraph);
  std::mt19937 random(3);
  const image::Image picture = rendered(frame, randomCamera(random, 64));
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto pixel = picture.at(x, y);
      ASSERT_TRUE(pixel[3] == 0 || pixel[3] == 1);
      EXPECT_NEAR(pixel[0], 0.25f * pixel[3], 3e-4f);
      EXPECT_NEAR(pixel[1], 2.f * pixel[3], 2e-3f);
      EXPECT_NEAR(pixel[2], 0.75f * pixel[3], 1e-3f);
    }
}

// A camera at a node whose pixels are the node's texels.
TEST_F(LumigraphFrameTest, ACameraAtANodeShowsTheNodesPicture) {
  const TriangleMesh mesh = bumpySphere(0.4);
  const Lumigraph lumigraph =
      lumigraphFrom(mesh, {.nodes = 3, .texels = 60000, .distance = 6, .overlap = 0}, glossy);
  LumigraphFrame frame(lumigraph);
  for (size_t k = 0; k < kSlabs; ++k) {
    const Slab& slab = lumigraph.slabs[k];
    const Vec3<double> node = slab.stPoint(1, 1).raw();
    capture::Camera<AcquisitionSpace> camera;
    Mat3<double> rotation = Mat3<double>::Zero(); // u to the right, v down
    rotation(0, slab.uAxis()) = 1, rotation(1, slab.vAxis()) = -1, rotation(2, slab.axis) = slab.sign;
    // That is left-handed for a viewer outside: u is mirrored instead.
    rotation(0, slab.uAxis()) = rotation.determinant() < 0 ? -1 : 1;
    const bool mirrored = rotation(0, slab.uAxis()) < 0;
    camera.cameraFromWorld = {rotation, -(rotation * node)};
    const double depth = std::abs(slab.stPlane - slab.uvPlane);
    camera.lens.width = slab.width, camera.lens.height = slab.height;
    camera.lens.focalX = camera.lens.focalY = depth / slab.uvSpacing;
    const double left = (node[slab.uAxis()] - slab.uvLow[0]) / slab.uvSpacing;
    camera.lens.centerX = mirrored ? slab.width - left : left;
    camera.lens.centerY = (node[slab.vAxis()] - slab.uvLow[1]) / slab.uvSpacing;
    const image::Image picture = rendered(frame, camera);
    size_t covered = 0;
    for (int y = 0; y < slab.height; ++y)
      for (int x = 0; x < slab.width; ++x) {
        const Texel& texel = lumigraph.picture(k, 1, 1)[y * slab.width + (mirrored ? slab.width - 1 - x : x)];
        const auto pixel = picture.at(x, y);
        if (texel[3] == 0 || pixel[3] == 0) continue;
        ++covered;
        for (size_t channel = 0; channel < 3; ++channel)
          EXPECT_NEAR(pixel[channel], image::floatOfHalf(texel[channel]), 0.002f);
      }
    EXPECT_GT(covered, 100u);
  }
}

TEST_F(LumigraphFrameTest, SamplesAreAveraged) {
  LumigraphFrame frame(lumigraphFrom(bumpySphere(0), {.nodes = 3, .texels = 50000}, glossy));
  const auto camera = lookingAt({0, 0, 5}, {0, 0, 0}, 32);
  auto fine = camera;
  fine.lens = capture::resized(camera.lens, 64, 64);
  const image::Image mean = rendered(frame, camera, 2), samples = rendered(frame, fine);
  for (int y = 0; y < 32; ++y)
    for (int x = 0; x < 32; ++x)
      for (size_t channel = 0; channel < 4; ++channel)
        EXPECT_NEAR(mean.at(x, y)[channel],
                    (samples.at(2 * x, 2 * y)[channel] + samples.at(2 * x + 1, 2 * y)[channel] +
                     samples.at(2 * x, 2 * y + 1)[channel] + samples.at(2 * x + 1, 2 * y + 1)[channel]) /
                        4,
                    1e-6f);
}

// Cameras inside the hull, inside the object, on the surface and beyond the st planes.
TEST_F(LumigraphFrameTest, IsFiniteFromEverywhere) {
  const TriangleMesh mesh = bumpySphere(0.4);
  LumigraphFrame frame(lumigraphFrom(mesh, {.nodes = 3, .texels = 50000, .distance = 2}, glossy));
  const Vec3<double> corner = mesh.positions[100].cast<double>().raw();
  for (const Vec3<double>& place :
       {Vec3<double>(0, 0, 0), Vec3<double>(corner), Vec3<double>(1.1, 0.1, 0), Vec3<double>(100, 3, 7)})
    for (const Vec3<double>& to : {Vec3<double>(0.3, 0.2, -0.1), Vec3<double>(2, 2, 2)})
      for (const float value : rendered(frame, lookingAt(place, to, 32)).values)
        EXPECT_TRUE(std::isfinite(value));
}

TEST_F(LumigraphFrameTest, GivesTheSameBitsWhateverWasRenderedBefore) {
  LumigraphFrame frame(lumigraphFrom(bumpySphere(0.4), {.nodes = 3, .texels = 50000}, glossy));
  const auto camera = lookingAt({1, 2, 4}, {0, 0, 0}, 48);
  const image::Image first = rendered(frame, camera);
  rendered(frame, lookingAt({-4, 1, 0}, {0, 0, 0}, 20));
  EXPECT_EQ(first.values, rendered(frame, camera).values);
}

TEST_F(LumigraphFrameTest, RefusesOtherLensesThanPinholes) {
  LumigraphFrame frame(lumigraphFrom(bumpySphere(0), {.nodes = 2, .texels = 5000}, glossy));
  auto camera = lookingAt({0, 0, 5}, {0, 0, 0}, 8);
  camera.lens.k1 = 0.1;
  EXPECT_THROW(rendered(frame, camera), Error);
  camera.lens.k1 = 0;
  camera.lens.model = capture::Lens::Model::orthographic;
  EXPECT_THROW(rendered(frame, camera), Error);
}

} // namespace
} // namespace surflect::lumigraph
