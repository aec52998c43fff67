#include "render/lightfield/slf/observations.h"

#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <vector>

namespace surflect::slf {
namespace {

constexpr int kSide = 9;

// A capture of boxes with its photographs in memory.
struct Scene {
  image::TemporaryFolder folder;
  lightfield::Views views;
  Photographs photographs;
  SmoothNormals normals;
  std::vector<Chart> charts;

  Scene(const TriangleMesh& mesh, const boxes::RadianceAt& radianceAt, const boxes::Shoot& shoot)
      : views((boxes::writeCapture(mesh, radianceAt, shoot, folder.path()), folder.path())),
        photographs(views), normals(views.mesh()), charts(boxes::faceCharts(views.mesh(), kSide)) {}

  Observations of(size_t chart) const {
    const std::vector<TexelPoint> points = texelPoints(views.mesh(), charts[chart]);
    return {points, kSide, views.mesh(), normals, photographs, views.rays()};
  }
  std::vector<TexelPoint> points(size_t chart) const { return texelPoints(views.mesh(), charts[chart]); }
};

Rgb colorOf(const Vec3<double>& place, const Vec3<double>& towards) {
  return {static_cast<float>(2 + place[0]), static_cast<float>(1 + towards[1] / 2),
          static_cast<float>(place[2] + 1)};
}

bool isOnRim(size_t texel) {
  const size_t x = texel % kSide, y = texel / kSide;
  return x == 0 || y == 0 || x == kSide - 1 || y == kSide - 1;
}

TEST(Observations, AFaceOfAConvexBodyIsSeenByTheCamerasInFrontOfIt) {
  const Scene scene(boxes::unitCube(), colorOf, {studio::spiral(24), 96, 0.3});
  for (size_t chart = 0; chart < scene.charts.size(); ++chart) {
    const Observations observations = scene.of(chart);
    const auto points = scene.points(chart);
    for (size_t texel = 0; texel < points.size(); ++texel) {
      if (isOnRim(texel)) continue; // pixels of the silhouette may be missing
      const Vec3<double> normal = areaVector(scene.views.mesh(), points[texel].meshTriangle).normalized();
      std::set<uint32_t> expected, found;
      for (uint32_t p = 0; p < scene.photographs.size(); ++p) {
        const auto towards = normalized(scene.photographs.camera(p).center() - points[texel].position);
        // Clearly in front, where a texel is more than a pixel in the picture.
        if (towards.raw().dot(normal) > 0.3) expected.insert(p);
      }
      for (const Observation& o : observations.of(texel)) {
        found.insert(o.photograph);
        EXPECT_GT(o.towards.raw().cast<double>().dot(normal), kGrazing);
        EXPECT_GT(o.fade, 0);
        EXPECT_LE(o.fade, 1);
      }
      EXPECT_TRUE(std::ranges::includes(found, expected));
    }
  }
}

TEST(Observations, ShowTheRadianceThatLeftThePlaceTowardsTheCamera) {
  const Scene scene(boxes::unitCube(), colorOf, {studio::spiral(24), 128, 0.3});
  for (size_t chart = 0; chart < scene.charts.size(); ++chart) {
    const Observations observations = scene.of(chart);
    const auto points = scene.points(chart);
    for (size_t texel = 0; texel < points.size(); ++texel) {
      if (isOnRim(texel)) continue; // where pixels mix two faces
      for (const Observation& o : observations.of(texel)) {
        const auto towards =
            normalized(scene.photographs.camera(o.photograph).center() - points[texel].position);
        EXPECT_NEAR((towards.cast<float>().raw() - o.towards.raw()).norm(), 0, 1e-6);
        const Rgb color = colorOf(points[texel].position.raw(), towards.raw());
        // Half floats of about 2 and bilinear interpolation.
        EXPECT_NEAR(o.radiance[0], color.r, 4e-3);
        EXPECT_NEAR(o.radiance[1], color.g, 4e-3);
        EXPECT_NEAR(o.radiance[2], color.b, 4e-3);
      }
    }
  }
}

TEST(Observations, AnOccluderHidesWhatLiesBehindIt) {
  // A bright plate above a dark table, photographed from straight above and from the side.
  TriangleMesh mesh;
  boxes::addBox(mesh, {-0.8f, -0.8f, -0.2f}, {0.8f, 0.8f, -0.1f});
  boxes::addBox(mesh, {-0.3f, -0.3f, 0.2f}, {0.3f, 0.3f, 0.3f});
  const auto radiance = [](const Vec3<double>& place, const Vec3<double>&) {
    return place[2] > 0 ? Rgb{100, 100, 100} : Rgb{1, 1, 1};
  };
  const Scene scene(mesh, radiance, {{{0, 0, 1}, {1, 0, 0.4}}, 128, 0.35});
  size_t seenFromAbove = 0, hiddenFromAbove = 0;
  for (size_t chart = 0; chart < scene.charts.size(); ++chart) {
    const auto points = scene.points(chart);
    const Observations observations = scene.of(chart);
    for (size_t texel = 0; texel < points.size(); ++texel) {
      const Vec3<double> p = points[texel].position.raw();
      if (std::abs(p[2] + 0.1) > 1e-6 || isOnRim(texel)) continue;
      // The plate's lower edge, seen from (0, 0, 4), is projected onto the table's plane.
      const double shadow = 0.3 * 4.1 / (4 - 0.3);
      const double reach = std::max(std::abs(p[0]), std::abs(p[1]));
      bool fromAbove = false;
      for (const Observation& o : observations.of(texel)) {
        fromAbove = fromAbove || o.photograph == 0;
        EXPECT_NEAR(o.radiance[0], 1, 1e-3) << "the plate must not show on the table";
      }
      if (reach < shadow) {
        EXPECT_FALSE(fromAbove);
      }
      if (reach > shadow + 0.25) {
        EXPECT_TRUE(fromAbove);
      } // a texel further, as those at the edge are left out
      ++(fromAbove ? seenFromAbove : hiddenFromAbove);
    }
  }
  EXPECT_GT(seenFromAbove, 10u);
  EXPECT_GT(hiddenFromAbove, 4u);
}

TEST(Observations, PlacesOutsideThePictureAreNotSeen) {
  const Scene scene(boxes::unitCube(), colorOf, {{{0, 0, 1}}, 64, 0.08}); // shows the middle of a face only
  for (size_t chart = 0; chart < scene.charts.size(); ++chart) {
    const auto points = scene.points(chart);
    const Observations observations = scene.of(chart);
    for (size_t texel = 0; texel < points.size(); ++texel) {
      const Vec3<double> p = points[texel].position.raw();
      const double reach = std::max(std::abs(p[0]), std::abs(p[1]));
      if (p[2] < 0.499 || reach > 3.5 * std::tan(0.08)) {
        EXPECT_TRUE(observations.of(texel).empty());
      } else if (reach < 0.2) {
        EXPECT_EQ(observations.of(texel).size(), 1u);
      }
    }
  }
}

TEST(Observations, HeldOutViewsDoNotObserve) {
  const Scene scene(boxes::unitCube(), colorOf,
                    {studio::spiral(20), 48, 0.3,
                     [](size_t view) { return view % 2 ? capture::Split::test : capture::Split::train; }});
  EXPECT_EQ(scene.photographs.size(), 10u);
}

} // namespace
} // namespace surflect::slf
