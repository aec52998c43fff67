#include "render/lightfield/lumigraph/reconstruction.h"

#include "render/lightfield/lumigraph/reference.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"
#include "tests/support/random.h"

#include <random>

namespace surflect::lumigraph {
namespace {

constexpr SlabOptions kOptions{.nodes = 4, .texels = 120000};

TEST(Reconstruction, WeightsSumToOne) {
  std::mt19937 random(1);
  const Slabs slabs = slabsAround(bumpySphere(0.3), kOptions);
  for (int n = 0; n < 500; ++n) {
    const Point p = assume<Point>(randomUnit(random)), viewer = assume<Point>(5 * randomUnit(random));
    double sum = 0;
    const std::vector<Tap> taps = tapsAt(slabs, 0.3, p, viewer);
    EXPECT_LE(taps.size(), 12u);
    for (const Tap& tap : taps) sum += tap.weight;
    EXPECT_NEAR(sum, 1, 1e-12);
  }
}

TEST(Reconstruction, AskedFromANodeTakesThatNodeAlone) {
  const Slabs slabs = slabsAround(bumpySphere(0.3), kOptions);
  for (size_t k = 0; k < kSlabs; ++k) {
    const Point p(0.1, -0.2, 0.3);
    double weight = 0;
    for (const Tap& tap : tapsAt(slabs, 0, p, slabs[k].stPoint(1, 2)))
      if (tap.slab == k && tap.i == 1 && tap.j == 2) weight += tap.weight;
    EXPECT_NEAR(weight, 1, 1e-9);
  }
}

// Depth correction: all nodes show the same point, so a texture without highlights is not blurred between
// them.
TEST(Reconstruction, OfAMatteObjectIsAsSharpAsItsTexels) {
  const Radiance matte = [](const Point& p, const Direction&) {
    return Eigen::Vector3d(0.5 + 0.3 * p.x(), 0.5 + 0.3 * p.y(), 0.5 + 0.3 * p.z());
  };
  const TriangleMesh mesh = bumpySphere(0);
  const Lumigraph lumigraph = lumigraphFrom(mesh, {.nodes = 3, .texels = 200000}, matte);
  std::mt19937 random(2);
  double largest = 0;
  for (int n = 0; n < 300; ++n) {
    const Point p = mesh.positions[random() % mesh.positions.size()].cast<double>();
    const Direction towards = assume<Direction>((p.raw() + 0.5 * randomUnit(random)).normalized());
    const Eigen::Vector4d found = radianceAt(lumigraph, p, p + 3. * towards);
    largest = std::max(largest, (found.head<3>() - matte(p, towards)).cwiseAbs().maxCoeff());
  }
  EXPECT_LE(largest, 0.02);
}

TEST(Reconstruction, OfAConstantObjectIsConstant) {
  const Eigen::Vector3d color(0.25, 2, 0.75);
  const TriangleMesh mesh = bumpySphere(0.4);
  const Lumigraph lumigraph =
      lumigraphFrom(mesh, kOptions, [&](const Point&, const Direction&) { return color; });
  std::mt19937 random(3);
  const image::Image picture = Reference(lumigraph).render(randomCamera(random, 64));
  size_t covered = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto pixel = picture.at(x, y);
      EXPECT_TRUE(pixel[3] == 0 || pixel[3] == 1);
      covered += pixel[3] == 1;
      for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(pixel[channel], pixel[3] * color[channel], 1e-3 * color[channel]);
    }
  EXPECT_GT(covered, 500u);
}

// Off the outline of a simplified geometry texels tell that the object is not there.
TEST(Reconstruction, OnASimplifiedGeometryAlphaFollowsTheTexels) {
  const TriangleMesh mesh = bumpySphere(0);
  Lumigraph lumigraph = lumigraphFrom(mesh, kOptions, glossy);
  lumigraph.geometry.exactOutline = false;
  EXPECT_NEAR(radianceAt(lumigraph, {0, 0, 0.99}, {0, 0, 5})[3], 1, 1e-9);
  const Eigen::Vector4d beside = radianceAt(lumigraph, {1.3, 0, 0}, {1.3, 0, 5});
  EXPECT_EQ(beside, Eigen::Vector4d::Zero());
}

TEST(Reconstruction, OfAPointAtTheViewerIsNothing) {
  const Lumigraph lumigraph = lumigraphFrom(bumpySphere(0), kOptions, glossy);
  EXPECT_EQ(radianceAt(lumigraph, {0, 0, 1}, {0, 0, 1}), Eigen::Vector4d::Zero());
}

} // namespace
} // namespace surflect::lumigraph
