#include "render/lightfield/lumigraph/lumigraph_frame.h"

#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/reference.h"
#include "tests/render/gl/gl_test.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

namespace surflect::lumigraph {
namespace {

class LumigraphFrameTest : public gl::GlTest {
protected:
  static image::Image rendered(LumigraphFrame& frame, const capture::Camera<AcquisitionSpace>& camera,
                               int samples = 1) {
    std::map<std::string, double> seconds;
    return frame.render(camera, {.samples = samples}, seconds).color;
  }
};

// Mean of squared differences, in decibels of a peak of 1.
struct MeanSquare {
  double sum = 0, count = 0; // of channels

  void add(double squares) { sum += squares, count += 4; }
  double decibels() const { return -10 * std::log10(sum / count); }
};

// Agreement of two pictures over the pixels that either covers.
struct Agreement {
  size_t covered = 0;
  size_t disputed = 0;   // differ by over 0.01: an outline passes through the pixel's centre
  MeanSquare common;     // of pixels that both cover
  MeanSquare undisputed; // of pixels that are not disputed
};
Agreement agreementOf(const image::Image& a, const image::Image& b) {
  Agreement agreement;
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
      if (p[3] > 0 && q[3] > 0) agreement.common.add(square);
      if (largest > 0.01)
        ++agreement.disputed;
      else
        agreement.undisputed.add(square);
    }
  return agreement;
}

TEST_F(LumigraphFrameTest, AgreesWithTheReferenceFrom20Cameras) {
  const TriangleMesh mesh = bumpySphere(0.4);
  for (const double overlap : {0., 1e-6, 0.2}) {
    const Lumigraph lumigraph =
        lumigraphFrom(mesh, {.nodes = 4, .texels = 150000, .overlap = overlap}, glossy);
    LumigraphFrame frame(lumigraph);
    const Reference reference(lumigraph);
    std::mt19937 random(1);
    for (int n = 0; n < 20; ++n) {
      const auto camera = randomCamera(random, 96);
      const Agreement agreement = agreementOf(rendered(frame, camera), reference.render(camera));
      EXPECT_GE(agreement.common.decibels(), 51); // a pixel on an inner outline costs that much
      EXPECT_GE(agreement.undisputed.decibels(), 117);
      EXPECT_GT(agreement.covered, 1000u);
      EXPECT_LE(static_cast<double>(agreement.disputed), 0.002 * static_cast<double>(agreement.covered));
    }
  }
}

TEST_F(LumigraphFrameTest, AgreesWithTheReferenceWhereTexelsTellTheOutline) {
  const TriangleMesh mesh = bumpySphere(0.4), coarse = bumpySphere(0.4, 12);
  Lumigraph lumigraph = lumigraphFrom(mesh, {.nodes = 4, .texels = 150000}, glossy);
  lumigraph.geometry = {coarse, fringeAround(mesh, coarse), false};
  LumigraphFrame frame(lumigraph);
  const Reference reference(lumigraph);
  std::mt19937 random(2);
  for (int n = 0; n < 5; ++n) {
    const auto camera = randomCamera(random, 96);
    EXPECT_GE(agreementOf(rendered(frame, camera), reference.render(camera)).undisputed.decibels(), 86);
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

// A camera at a node whose pixels are the node's texels; row 0 of the picture is the last of the texels.
TEST_F(LumigraphFrameTest, ACameraAtANodeShowsTheNodesPicture) {
  const TriangleMesh mesh = bumpySphere(0.4);
  const Lumigraph lumigraph =
      lumigraphFrom(mesh, {.nodes = 3, .texels = 60000, .distance = 6, .overlap = 0}, glossy);
  LumigraphFrame frame(lumigraph);
  for (size_t k = 0; k < kSlabs; ++k) {
    const Slab& slab = lumigraph.slabs[k];
    const Vec3<double> node = slab.stPoint(1, 1).raw();
    capture::Camera<AcquisitionSpace> camera;
    Mat3<double> rotation = Mat3<double>::Zero(); // u to the right, v up
    rotation(0, slab.uAxis()) = 1, rotation(1, slab.vAxis()) = 1, rotation(2, slab.axis) = slab.sign;
    ASSERT_EQ(rotation.determinant(), 1);
    camera.cameraFromWorld = {rotation, -(rotation * node)};
    camera.lens.width = slab.width, camera.lens.height = slab.height;
    camera.lens.focalX = camera.lens.focalY = std::abs(slab.stPlane - slab.uvPlane) / slab.uvSpacing;
    camera.lens.centerX = (node[slab.uAxis()] - slab.uvLow[0]) / slab.uvSpacing;
    camera.lens.centerY = slab.height - (node[slab.vAxis()] - slab.uvLow[1]) / slab.uvSpacing;
    const image::Image picture = rendered(frame, camera);
    size_t covered = 0, differsFromOwn = 0, differsFromNext = 0; // pixels
    for (int y = 0; y < slab.height; ++y)
      for (int x = 0; x < slab.width; ++x) {
        const size_t place = static_cast<size_t>((slab.height - 1 - y) * slab.width + x);
        const auto pixel = picture.at(x, y);
        const auto differsFrom = [&](const Texel& texel) {
          if ((texel[3] != 0) != (pixel[3] > 0)) return true;
          for (size_t channel = 0; channel < 3; ++channel)
            if (pixel[3] > 0 && std::abs(pixel[channel] - image::floatOfHalf(texel[channel])) > 0.002f)
              return true;
          return false;
        };
        covered += pixel[3] > 0;
        differsFromOwn += differsFrom(lumigraph.picture(k, 1, 1)[place]);
        differsFromNext += differsFrom(lumigraph.picture(k, 0, 1)[place]);
      }
    EXPECT_GT(covered, 100u);
    EXPECT_LE(static_cast<double>(differsFromOwn), 0.01 * static_cast<double>(covered)); // at outlines
    EXPECT_GT(static_cast<double>(differsFromNext), 0.5 * static_cast<double>(covered));
  }
}

TEST_F(LumigraphFrameTest, DepthIsTheDistanceAlongTheViewingAxis) {
  const TriangleMesh mesh = bumpySphere(0.4);
  const Lumigraph lumigraph = lumigraphFrom(mesh, {.nodes = 3, .texels = 50000}, glossy);
  LumigraphFrame frame(lumigraph);
  const RayCaster<AcquisitionSpace> rays(mesh);
  const auto camera = lookingAt({1, 2, 4}, {0, 0, 0}, 64);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  std::map<std::string, double> seconds;
  const LumigraphFrame::Picture picture = frame.render(camera, {.depth = true}, seconds);
  size_t disputed = 0, covered = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double found = static_cast<double>(picture.depth.at(x, y)[0]);
      EXPECT_EQ(std::isfinite(found), picture.color.at(x, y)[3] > 0);
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      const auto hit = rays.firstHit(camera.center(), worldFromCamera(ray->direction));
      if (!hit) continue;
      ++covered;
      if (!(std::abs(found + hit->distance * ray->direction.z()) <= 1e-4)) ++disputed;
    }
  EXPECT_GT(covered, 500u);
  EXPECT_LE(static_cast<double>(disputed), 0.01 * static_cast<double>(covered)); // at outlines
  // Depth of several samples is that of the nearest.
  auto fine = camera;
  fine.lens = capture::resized(camera.lens, 128, 128);
  const image::Image nearest = frame.render(camera, {.samples = 2, .depth = true}, seconds).depth,
                     samples = frame.render(fine, {.depth = true}, seconds).depth;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x)
      EXPECT_EQ(nearest.at(x, y)[0],
                std::min({samples.at(2 * x, 2 * y)[0], samples.at(2 * x + 1, 2 * y)[0],
                          samples.at(2 * x, 2 * y + 1)[0], samples.at(2 * x + 1, 2 * y + 1)[0]}));
}

// At directions where two or three slabs meet.
TEST_F(LumigraphFrameTest, IsFiniteForTheLeastOverlaps) {
  for (const double overlap : {1e-300, 1e-9, 1e-7, 1e-6, 1e-3}) {
    LumigraphFrame frame(
        lumigraphFrom(bumpySphere(0), {.nodes = 2, .texels = 5000, .overlap = overlap},
                      [](const Point&, const Direction&) { return Eigen::Vector3d(1, 1, 1); }));
    for (const Vec3<double>& place : {Vec3<double>(4, 4, 0), Vec3<double>(4, 4, 4), Vec3<double>(-4, 0, 4)}) {
      const image::Image picture = rendered(frame, lookingAt(place, {0, 0, 0}, 33));
      for (int y = 0; y < 33; ++y)
        for (int x = 0; x < 33; ++x)
          for (size_t channel = 0; channel < 3; ++channel)
            EXPECT_NEAR(picture.at(x, y)[channel], picture.at(x, y)[3], 1e-5f);
      EXPECT_EQ(picture.at(16, 16)[3], 1);
    }
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
