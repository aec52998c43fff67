#include "render/lightfield/olf/triangle_blends.h"

#include "tests/render/lightfield/olf/continuity.h"
#include "tests/render/lightfield/olf/painted_field.h"
#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <map>
#include <utility>

namespace surflect::olf {
namespace {

ClosestViews closestOf(std::initializer_list<WeightedView> views) {
  ClosestViews closest;
  for (const WeightedView& view : views) closest.push(view);
  return closest;
}

double weightOf(const TriangleBlend& blend, size_t corner, uint32_t view) {
  for (size_t k = 0; k < blend.count; ++k)
    if (blend.views[k] == view) return static_cast<double>(blend.weights[corner][k]);
  return 0;
}

TEST(Combined, IsFigure3) {
  const TriangleBlend blend =
      combined({closestOf({{0, 0.5}, {1, 0.3}, {2, 0.2}}), closestOf({{0, 0.1}, {4, 0.6}, {5, 0.3}}),
                closestOf({{1, 0.25}, {3, 0.25}, {4, 0.5}})});
  EXPECT_EQ(blend.count, 6u);
  EXPECT_FLOAT_EQ(static_cast<float>(weightOf(blend, 0, 2)), 0.2f);
  EXPECT_EQ(weightOf(blend, 0, 4), 0);
  EXPECT_FLOAT_EQ(static_cast<float>(weightOf(blend, 1, 4)), 0.6f);
  EXPECT_EQ(weightOf(blend, 1, 1), 0);
  EXPECT_FLOAT_EQ(static_cast<float>(weightOf(blend, 2, 3)), 0.25f);
  EXPECT_EQ(weightOf(blend, 2, 0), 0);
}

TEST(Combined, HoldsNineViews) {
  const TriangleBlend blend =
      combined({closestOf({{0, 0.5}, {1, 0.3}, {2, 0.2}}), closestOf({{3, 0.1}, {4, 0.6}, {5, 0.3}}),
                closestOf({{6, 0.25}, {7, 0.25}, {8, 0.5}})});
  EXPECT_EQ(blend.count, 9u);
}

class Blends : public ::testing::TestWithParam<Blending> {};
INSTANTIATE_TEST_SUITE_P(ViewBlender, Blends, ::testing::Values(Blending::vdtm, Blending::ulr));

TEST_P(Blends, SumToOneForAViewerAtAVertex) {
  const OpacityField field = paintedField(lightfield::bumpySphere(0, 10), 30, 8, GetParam());
  const ViewBlender blender(field);
  for (uint32_t vertex = 0; vertex < field.mesh.positions.size(); ++vertex) {
    if (field.visible.of(vertex).empty()) continue;
    double sum = 0;
    for (const WeightedView& view :
         blender.closest(vertex, field.mesh.positions[vertex].cast<double>().raw()))
      sum += view.weight;
    EXPECT_NEAR(sum, 1, 1e-12) << vertex;
  }
}

TEST_P(Blends, AgreeOnSharedEdgesAndSumToOne) {
  const OpacityField field = paintedField(lightfield::bumpySphere(0, 16), 60, 8, GetParam());
  const ViewBlender blender(field);
  std::mt19937 random(7);
  for (int trial = 0; trial < 10; ++trial) {
    const auto blends = blender.blends(4 * randomUnit(random));
    std::map<std::pair<uint32_t, uint32_t>, double> atVertex; // weights by vertex and view
    for (size_t t = 0; t < blends.size(); ++t)
      for (size_t corner = 0; corner < 3; ++corner) {
        double sum = 0;
        for (size_t k = 0; k < blends[t].count; ++k) {
          const double weight = static_cast<double>(blends[t].weights[corner][k]);
          EXPECT_GE(weight, 0);
          sum += weight;
          if (weight == 0) continue;
          const auto [at, isNew] =
              atVertex.emplace(std::pair(field.mesh.triangles[t][corner], blends[t].views[k]), weight);
          EXPECT_EQ(at->second, weight);
        }
        EXPECT_NEAR(sum, 1, 1e-6);
      }
  }
}

TEST_P(Blends, AreContinuousAlongPaths) {
  const OpacityField field = paintedField(lightfield::bumpySphere(0, 12), 80, 8, GetParam());
  const ViewBlender blender(field);
  std::mt19937 random(8);
  int paths = 0;
  while (paths < 1000) { // that stay above the horizon of a vertex
    const auto vertex = static_cast<uint32_t>(random() % field.mesh.positions.size());
    if (field.visible.of(vertex).size() < 4) continue;
    ++paths;
    const Vec3<double> p = field.mesh.positions[vertex].cast<double>().raw();
    const Vec3<double> from = 4 * (p.normalized() + 0.5 * randomUnit(random)).normalized(),
                       to = 4 * (p.normalized() + 0.5 * randomUnit(random)).normalized();
    const PathChange change = changeAlong(
        [&](double share) { return blender.closest(vertex, (1 - share) * from + share * to); }, 300);
    EXPECT_LE(change.last, 1e-5) << "path " << paths;
    EXPECT_TRUE(change.halves) << "path " << paths;
  }
}

TEST(ViewBlender, TooManyViewsOfAMeshAreAnError) {
  VisibleViews visible{{0, 40'000, 80'000}, std::vector<uint32_t>(80'000)};
  EXPECT_EQ(image::errorOf([&] { requireTriangulable(visible); }),
            "views of a vertex: found 40000, expected 32767 at most");
  visible.first = {0, 30'000, 60'000, 80'000};
  EXPECT_EQ(
      image::errorOf([&] { requireTriangulable(visible, 2 << 20); }),
      "mesh: triangulations of the views of 3 vertices take 3 MiB, expected 2 at most: take fewer triangles");
  requireTriangulable(visible, 4 << 20);
}

} // namespace
} // namespace surflect::olf
