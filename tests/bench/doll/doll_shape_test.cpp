#include "bench/doll/doll_shape.h"

#include "bench/doll/doll_model.h"
#include "srf/capture/silhouette.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace surflect::bench {
namespace {

TEST(DollShape, OutlineIsWhereRaysMeetTheDoll) {
  for (const size_t view : {0, 3, 7, 11}) {
    const auto camera = dollCameras({.views = 12, .width = 63, .height = 80})[view];
    const auto outline = dollOutline(camera);
    size_t covered = 0;
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 63; ++x) {
        const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        const auto direction = camera.cameraFromWorld.inverse()(ray->direction);
        const bool meets = firstHit(camera.center().raw(), direction.raw()).has_value();
        ASSERT_EQ(meets, outline[static_cast<size_t>(y * 63 + x)] == 1) << view << ": " << x << ", " << y;
        covered += meets;
      }
    EXPECT_GT(covered, 63 * 80 / 5u);
    EXPECT_LT(covered, 63 * 80 / 2u);
  }
}

TEST(DollShape, HitsLieOnAPartAndInsideOfNone) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  int hits = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3<double> origin = 3 * Vec3<double>(any(random), any(random), any(random)).normalized();
    const Vec3<double> target(0.2 * any(random), 0.2 * any(random), 0.5 + 0.5 * any(random));
    const Vec3<double> direction = (target - origin).normalized();
    const auto hit = firstHit(origin, direction);
    if (!hit) continue;
    ++hits;
    double least = 1;
    for (const Ellipsoid& part : dollParts())
      least = std::min(least, excessOf(part, origin + hit->distance * direction));
    EXPECT_NEAR(least, 0, 1e-9);
    EXPECT_LT(hit->normal.dot(direction), 0);
    EXPECT_NEAR(hit->normal.norm(), 1, 1e-12);
  }
  EXPECT_GT(hits, 500);
}

// Triangles face outwards, and the outline of the mesh is that of the ellipsoids, except that faces between
// vertices lie inside.
TEST(DollShape, MeshIsTheSolid) {
  const auto camera = dollCameras({.views = 12, .width = 100, .height = 130})[5];
  const auto outline = dollOutline(camera);
  const image::Image silhouetteOfMesh =
      capture::silhouette(camera, RayCaster<AcquisitionSpace>(dollMesh(96)));
  size_t outside = 0, missing = 0;
  for (size_t pixel = 0; pixel < outline.size(); ++pixel) {
    outside += silhouetteOfMesh.values[pixel] == 1 && outline[pixel] == 0;
    missing += silhouetteOfMesh.values[pixel] == 0 && outline[pixel] == 1;
  }
  EXPECT_LE(outside, 1u); // rounding
  EXPECT_LE(missing, 12u);
  const TriangleMesh mesh = dollMesh(24);
  for (size_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
    const Vec3<double> corner = mesh.positions[mesh.triangles[triangle][0]].raw().cast<double>();
    const auto part = std::ranges::min_element(
        dollParts(), {}, [&](const Ellipsoid& e) { return std::abs(excessOf(e, corner)); });
    EXPECT_GT(areaVector(mesh, triangle).dot(corner - part->center), 0);
  }
}

} // namespace
} // namespace surflect::bench
