#include "render/lightfield/slf/pass_plan.h"

#include "bench/slf/synthetic_field.h"
#include "render/lightfield/slf/reference.h"
#include "tests/render/lightfield/slf/cameras.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using namespace bench;

constexpr PlanOptions kNoCulling{.regionCulling = false, .directionCulling = false, .scissor = false};

bool isIn(const std::vector<uint32_t>& sorted, uint32_t value) {
  return std::ranges::binary_search(sorted, value);
}

// Equal lists of passes.
void expectEqual(const PassPlan& a, const PassPlan& b) {
  ASSERT_EQ(a.regions.size(), b.regions.size());
  for (size_t i = 0; i < a.regions.size(); ++i) {
    EXPECT_EQ(a.regions[i].region, b.regions[i].region);
    EXPECT_EQ(a.regions[i].triangles, b.regions[i].triangles);
    EXPECT_EQ(a.regions[i].directions, b.regions[i].directions);
  }
}

// Cameras from everywhere, also from within the object.
std::vector<Camera> cameras(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> distance(0, 3);
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const Vec3<double> place = distance(random) * randomUnit(random);
    cameras.push_back(cameraAt(place, randomUnit(random) - place, 32, 24, 30));
  }
  return cameras;
}

TEST(PassPlan, NoPassThatAPixelNeedsIsLeftOut) {
  const Field field = syntheticField({.cells = 3, .quads = 5, .subdivisions = 2});
  const ConstantTextures textures(field, {1, 1, 1, 1});
  const Reference reference(field, textures);
  PassPlanner planner(field);
  size_t seen = 0;
  for (const Camera& camera : cameras(60, 1)) {
    const PassPlan plan = planner.plan(camera);
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    for (int y = 0; y < camera.lens.height; ++y)
      for (int x = 0; x < camera.lens.width; ++x) {
        const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
        const auto hit = reference.firstHit(worldFromCamera(ray->origin), worldFromCamera(ray->direction));
        if (!hit) continue;
        ++seen;
        const auto found = std::ranges::find(plan.regions, hit->region, &RegionPasses::region);
        ASSERT_NE(found, plan.regions.end());
        ASSERT_TRUE(isIn(found->triangles, hit->hats.triangle));
        for (size_t i = 0; i < 3; ++i) {
          ASSERT_TRUE(isIn(found->directions, hit->hats.directions[i]));
        }
        ASSERT_TRUE(x >= found->scissor.x && x < found->scissor.x + found->scissor.width);
        ASSERT_TRUE(y >= found->scissor.y && y < found->scissor.y + found->scissor.height);
      }
  }
  EXPECT_GT(seen, 5000u);
}

TEST(PassPlan, DoesNotDependOnThePlansBefore) {
  const Field field = syntheticField({.cells = 2, .quads = 3, .subdivisions = 2});
  PassPlanner lasting(field);
  for (const Camera& camera : cameras(100, 2))
    expectEqual(lasting.plan(camera), PassPlanner(field).plan(camera));
}

TEST(PassPlan, TheTraversalFindsTheSameFromEveryStart) {
  const Field field = syntheticField({.cells = 2, .quads = 3, .subdivisions = 1});
  const DirectionMesh& mesh = field.directionMeshes[0];
  const RegionBound bound = boundOf(field.mesh, field.regions[5].chart);
  std::vector<Vec3<double>> viewers;
  for (const Direction& r : mesh.directions()) viewers.push_back(3 * r.raw()); // near corners and edges
  std::mt19937 random(3);
  for (int i = 0; i < 20; ++i) viewers.push_back(2.5 * randomUnit(random));
  for (const Vec3<double>& viewer : viewers) {
    const RegionView view = viewOf(bound, viewer);
    uint32_t any = 0;
    const std::vector<uint32_t> expected = trianglesInView(mesh, view, 1e-5, any);
    for (uint32_t start = 0; start < mesh.triangles().size(); ++start) {
      uint32_t from = start;
      EXPECT_EQ(trianglesInView(mesh, view, 1e-5, from), expected);
    }
  }
}

TEST(PassPlan, WithoutCullingThereAreAllPasses) {
  const Field field = syntheticField({.cells = 2, .quads = 3, .subdivisions = 1});
  PassPlanner planner(field);
  for (const Camera& camera : cameras(5, 4))
    EXPECT_EQ(planner.plan(camera, kNoCulling).passes(), field.textures());
}

TEST(PassPlan, EachKindOfCullingLeavesOutPasses) {
  const Field field = syntheticField({.cells = 6, .quads = 4, .subdivisions = 2});
  PassPlanner planner(field);
  std::mt19937 random(5);
  size_t all = 0, byDirection = 0, byRegion = 0, both = 0;
  for (int i = 0; i < 20; ++i) {
    const Camera camera = randomCamera(random, 500, 500);
    all += field.textures();
    byDirection += planner.plan(camera, {.regionCulling = false}).passes();
    byRegion += planner.plan(camera, {.directionCulling = false}).passes();
    both += planner.plan(camera).passes();
  }
  // [Azuma 1999, §3.1] has 600 of 13,134 left.
  EXPECT_LT(static_cast<double>(both), 0.045 * static_cast<double>(all));
  EXPECT_LT(static_cast<double>(byDirection), 0.1 * static_cast<double>(all));
  EXPECT_LT(static_cast<double>(byRegion), 0.7 * static_cast<double>(all));
}

// From within the prisms of its regions, too, a picture has few directions.
TEST(PassPlan, ACloseUpNeedsNoMorePassesForARegionThanItHasDirections) {
  const Field field = syntheticField({.cells = 2, .quads = 6, .subdivisions = 3, .bump = 0});
  PassPlanner planner(field);
  std::mt19937 random(6);
  size_t most = 0;
  for (const double distance : {1.001, 1.01, 1.05}) // from the middle of a sphere of radius 1
    for (int i = 0; i < 20; ++i) {
      const Vec3<double> towards = randomUnit(random);
      const Camera camera = cameraAt(distance * towards, 0.1 * randomUnit(random) - towards, 60, 60, 200);
      for (const RegionPasses& region : planner.plan(camera).regions)
        most = std::max(most, region.directions.size());
    }
  RecordProperty("most", static_cast<int>(most));
  EXPECT_LE(most, 14u); // 17 x 17 degrees, and corners 11 degrees apart
}

TEST(PassPlan, NothingIsDrawnOfAnObjectBehindTheCamera) {
  const Field field = syntheticField();
  EXPECT_EQ(PassPlanner(field).plan(cameraAt({0, 0, 4}, {0, 0, 1}, 32, 24, 30)).passes(), 0u);
}

TEST(PassPlan, AFieldWithoutRegionsHasNoPasses) {
  const Field field;
  EXPECT_EQ(PassPlanner(field).plan(cameraAt({0, 0, 4}, {0, 0, 1}, 32, 24, 30)).passes(), 0u);
}

TEST(BasisFill, IsThreeTimesThePictureForARegionWithoutCulling) {
  const Field field = syntheticField({.cells = 1, .quads = 3, .subdivisions = 2});
  const Camera camera = cameraAt({1, 2, 3}, {-1, -2, -3}, 50, 40, 30);
  const PassPlan plan = PassPlanner(field).plan(camera, kNoCulling);
  // Each pixel is in one triangle, and that is drawn for each of its corners.
  EXPECT_NEAR(basisFill(field, plan, camera, false), 3. * 50 * 40 * 6, 1e-6);
}

TEST(BasisFill, FallsByVisitedTrianglesAndByScissors) {
  const Field field = syntheticField({.cells = 6, .quads = 4, .subdivisions = 2});
  PassPlanner planner(field);
  const Camera camera = cameraAt({1, 2, 3}, {-1, -2, -3}, 500, 500, 700);
  const PassPlan wide = planner.plan(camera, {.scissor = false}), tight = planner.plan(camera);
  const double all = basisFill(field, wide, camera, false), visited = basisFill(field, wide, camera, true);
  EXPECT_LT(visited, 0.7 * all);
  EXPECT_LT(basisFill(field, tight, camera, true), 0.08 * visited);
}

} // namespace
} // namespace surflect::slf
