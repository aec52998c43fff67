#include "srf/proxy/hull/smoothing.h"

#include "srf/proxy/hull/surface_nets.h"
#include "tests/srf/proxy/hull/shapes.h"

namespace surflect::hull {
namespace {

TriangleMesh noisyBall(double noise) {
  GridShape shape;
  shape.bricks = {5, 5, 5};
  shape.voxel = 2.6 / 39;
  shape.origin = Vec3<double>::Constant(-1.3);
  TriangleMesh mesh = surfaceNet(BrickGrid(
                                     shape, [](const Ball&) { return Region::mixed; },
                                     [](const shapes::Point& p) { return 1 - p.raw().norm(); }, {}),
                                 {});
  std::mt19937 random(8);
  std::normal_distribution<double> normal(0, noise * shape.voxel);
  for (auto& p : mesh.positions)
    p = assume<Point3<AcquisitionSpace>>(
        Vec3<double>(p.cast<double>().raw() + Vec3<double>(normal(random), normal(random), normal(random))));
  return mesh;
}

double roughness(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& p : mesh.positions) sum += std::pow(p.cast<double>().raw().norm() - 1, 2);
  return std::sqrt(sum / static_cast<double>(mesh.positions.size()));
}

TEST(Smoothing, RemovesNoiseAndKeepsVolume) {
  const TriangleMesh noisy = noisyBall(0.2), smooth = smoothed(noisy, 5, {});
  EXPECT_LT(roughness(smooth), roughness(noisy) / 2);
  EXPECT_NEAR(shapes::volume(smooth) / shapes::volume(noisy), 1, 0.003);
  EXPECT_EQ(smooth.triangles, noisy.triangles);
}

// Laplacian smoothing alone takes a tenth of the volume.
TEST(Smoothing, DoesNotShrinkInFiftyPairs) {
  const TriangleMesh ball = noisyBall(0);
  EXPECT_NEAR(shapes::volume(smoothed(ball, 50, {})) / shapes::volume(ball), 1, 0.01);
}

TEST(Smoothing, CommutesWithScaleAndShift) {
  const TriangleMesh mesh = noisyBall(0.2);
  const auto moved = [](TriangleMesh m) {
    for (auto& p : m.positions) p = {2 * p.x() + 1, 2 * p.y() - 3, 2 * p.z()};
    return m;
  };
  const TriangleMesh a = moved(smoothed(mesh, 3, {})), b = smoothed(moved(mesh), 3, {});
  for (size_t i = 0; i < a.positions.size(); ++i)
    EXPECT_LT((a.positions[i].raw() - b.positions[i].raw()).norm(), 1e-5f);
}

} // namespace
} // namespace surflect::hull
