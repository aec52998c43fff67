#include "srf/proxy/hull/surface_nets.h"

#include "tests/srf/proxy/hull/shapes.h"

namespace surflect::hull {

namespace {

using shapes::Point;

GridShape cube(double half, int bricks) {
  GridShape shape;
  shape.bricks = {bricks, bricks, bricks};
  shape.voxel = 2 * half / (BrickGrid::kSide * bricks - 1);
  shape.origin = Vec3<double>::Constant(-half);
  return shape;
}

BrickGrid sampled(
    const GridShape& shape, const std::function<double(const Vec3<double>&)>& field,
    const std::function<Region(const Ball&)>& regionOf = [](const Ball&) { return Region::mixed; }) {
  return BrickGrid(shape, regionOf, [&](const Point& p) { return field(p.raw()); }, {});
}

double ballField(const Vec3<double>& p) { return 1 - p.norm(); }
Region ballRegion(const Ball& ball) {
  const double distance = ballField(ball.center.raw());
  return distance > ball.radius ? Region::inside : distance < -ball.radius ? Region::outside : Region::mixed;
}

TEST(SurfaceNet, OfNoiseIsAClosedManifold) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> value(-1, 1);
    const GridShape shape = cube(1, 2);
    std::vector<double> noise(4096);
    for (double& v : noise) v = value(random) - 0.2 * (seed % 4);
    const TriangleMesh mesh = surfaceNet(
        sampled(shape,
                [&](const Vec3<double>& p) {
                  const Vec3<double> c = (p - shape.origin) / shape.voxel;
                  return shape.voxel *
                         noise[std::lround(c[0]) + 16 * std::lround(c[1]) + 256 * std::lround(c[2])];
                }),
        {});
    ASSERT_GT(mesh.triangles.size(), 500u);
    shapes::expectClosedManifold(mesh);
    EXPECT_GT(shapes::volume(mesh), 0);
  }
}

// All 256 cells, alone in empty and in full space.
TEST(SurfaceNet, OfEveryCellIsAClosedManifold) {
  for (int signs = 1; signs < 256; ++signs)
    for (const double around : {-1.0, 1.0}) {
      const GridShape shape = cube(1, 1);
      const TriangleMesh mesh =
          surfaceNet(sampled(shape,
                             [&](const Vec3<double>& p) {
                               const Vec3<double> c = (p - shape.origin) / shape.voxel;
                               const std::array<long, 3> corner{std::lround(c[0]) - 3, std::lround(c[1]) - 3,
                                                                std::lround(c[2]) - 3};
                               for (const long step : corner)
                                 if (step != 0 && step != 1) return around;
                               return signs >> (corner[0] + 2 * corner[1] + 4 * corner[2]) & 1 ? 0.1 : -0.1;
                             }),
                     {});
      ASSERT_FALSE(mesh.triangles.empty());
      shapes::expectClosedManifold(mesh);
    }
}

TEST(SurfaceNet, OfABallConvergesAtSecondOrder) {
  double bound = 0.02, volumeBound = 0.1;
  for (const int bricks : {3, 6}) {
    const TriangleMesh mesh = surfaceNet(sampled(cube(1.3, bricks), ballField, ballRegion), {});
    shapes::expectClosedManifold(mesh);
    EXPECT_EQ(shapes::eulerCharacteristic(mesh), 2);
    double largest = 0;
    for (const auto& p : mesh.positions)
      largest = std::max(largest, std::abs(ballField(p.cast<double>().raw())));
    EXPECT_LT(largest, bound);
    bound = largest / 3.3;
    const double volumeError = std::abs(shapes::volume(mesh) - 4 * std::numbers::pi / 3);
    EXPECT_LT(volumeError, volumeBound);
    volumeBound = volumeError / 3.3;
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
      EXPECT_GT(areaVector(mesh, t).dot(mesh.positions[mesh.triangles[t][0]].cast<double>().raw()), 0)
          << "inwards";
  }
}

TEST(SurfaceNet, BricksThatAreNotSampledChangeNothing) {
  const TriangleMesh all = surfaceNet(sampled(cube(1.3, 7), ballField), {}),
                     sparse = surfaceNet(sampled(cube(1.3, 7), ballField, ballRegion), {});
  EXPECT_EQ(all.positions, sparse.positions);
  EXPECT_EQ(all.triangles, sparse.triangles);
}

TEST(SurfaceNet, StaysClosedWhereRegionsAreMisjudged) {
  const auto guess = [](const Ball& ball) {
    const double pseudo = std::sin(37 * ball.center.x() + 91 * ball.center.y() + 53 * ball.center.z());
    return pseudo > 0.3 ? Region::inside : pseudo < -0.3 ? Region::outside : Region::mixed;
  };
  const TriangleMesh mesh = surfaceNet(sampled(cube(1.3, 6), ballField, guess), {});
  ASSERT_FALSE(mesh.triangles.empty());
  shapes::expectClosedManifold(mesh);
}

TEST(SurfaceNet, ClosesAtTheBorderOfTheGrid) {
  const TriangleMesh mesh = surfaceNet(
      sampled(
          cube(1, 2), [](const Vec3<double>&) { return 1.0; }, [](const Ball&) { return Region::inside; }),
      {});
  shapes::expectClosedManifold(mesh);
  EXPECT_EQ(shapes::eulerCharacteristic(mesh), 2);
  EXPECT_NEAR(shapes::volume(mesh), 8 * std::pow(14 / 15.0, 3), 0.2);
}

} // namespace

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
