#include "render/lightfield/slf/unseen_texels.h"

#include "render/lightfield/slf/resample.h"
#include "srf/image/half_float.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace surflect::slf {
namespace {

constexpr int kTileSide = 12; // texels

// Square charts of a plane, each with kTileSide^2 texels, and their textures in memory.
struct Tiles {
  Field field;
  std::vector<Chart> charts;
  std::vector<SeenRegion> seen;
  std::map<std::pair<size_t, size_t>, std::vector<Texel>> textures;
  size_t written = 0;

  Tiles(uint32_t columns, uint32_t rows, int subdivisions) {
    field.directionMeshes.emplace_back(octahedronDirections(subdivisions));
    for (uint32_t y = 0; y <= rows; ++y)
      for (uint32_t x = 0; x <= columns; ++x)
        field.mesh.positions.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.f);
    for (uint32_t y = 0; y < rows; ++y)
      for (uint32_t x = 0; x < columns; ++x) {
        const uint32_t first = y * (columns + 1) + x, above = first + columns + 1;
        Chart& chart = charts.emplace_back();
        chart.vertices = {first, first + 1, above + 1, above};
        // Each turned in its own way.
        const std::array<Vec2<float>, 4> corners{Vec2<float>(0, 0), {1, 0}, {1, 1}, {0, 1}};
        for (size_t i = 0; i < 4; ++i) chart.coordinates.push_back(corners[(i + charts.size()) % 4]);
        chart.triangles = {{0, 1, 2}, {0, 2, 3}};
        chart.width = chart.height = kTileSide;
        for (const auto& [a, b, c] : chart.triangles) {
          chart.meshTriangles.push_back(static_cast<uint32_t>(field.mesh.triangles.size()));
          field.mesh.triangles.push_back({chart.vertices[a], chart.vertices[b], chart.vertices[c]});
        }
        field.regions.push_back({chart, 0});
      }
    const size_t directions = base().directions().size();
    seen.assign(charts.size(),
                {std::vector<uint8_t>(directions, 1), std::vector<bool>(kTileSide * kTileSide, false)});
  }

  const DirectionMesh& base() const { return field.directionMeshes[0]; }

  // Point of the plane at a texel's centre.
  Vec2<double> pointOf(size_t region, size_t texel) const {
    const Chart& chart = charts[region];
    const Vec2<float> place((static_cast<float>(texel % kTileSide) + 0.5f) / kTileSide,
                            (static_cast<float>(texel / kTileSide) + 0.5f) / kTileSide);
    // Coordinates are an affine map of the square's corners 0, 1 and 3.
    const Vec2<float> o = chart.coordinates[0], u = chart.coordinates[1] - o, v = chart.coordinates[3] - o;
    const Vec3<float>& p = field.mesh.positions[chart.vertices[0]].raw();
    return {double{p[0]} + double{(place - o).dot(u)}, double{p[1]} + double{(place - o).dot(v)}};
  }

  // Textures of seen texels by radianceAt(point, direction); black elsewhere.
  template <class Radiance> void paint(const Radiance& radianceAt) {
    for (size_t region = 0; region < charts.size(); ++region) {
      const auto directions = field.directionsOf(region).directions();
      for (size_t i = 0; i < directions.size(); ++i) {
        auto& texture = textures[{region, i}];
        texture.assign(kTileSide * kTileSide, Texel{});
        for (size_t texel = 0; texel < texture.size(); ++texel)
          if (seen[region].isSeen[texel])
            texture[texel] = texelOf(radianceAt(pointOf(region, texel), directions[i]), true);
      }
    }
  }

  std::vector<uint8_t> fill(const BorderPoints& points) {
    return fillUnseenTexels(field, seen, base(), points,
                            {[&](size_t region, size_t direction) {
                               return textures.at({region, direction});
                             },
                             [&](size_t region, size_t direction, std::span<const Texel> texels) {
                               textures[{region, direction}] = {texels.begin(), texels.end()};
                               ++written;
                             }});
  }
  BorderPoints borders() const { return borderPoints(field.mesh, charts, 1.0 / kTileSide); }

  float red(size_t region, size_t direction, size_t texel) const {
    return image::floatOfHalf(textures.at({region, direction})[texel][0]);
  }
};

TEST(BorderPoints, AreSharedByTheChartsThatMeetThere) {
  const Tiles tiles(3, 2, 0);
  const BorderPoints borders = tiles.borders();
  // 12 parts of each of the 17 edges between 12 vertices.
  EXPECT_EQ(borders.count, size_t{12 + 17 * 11});
  std::map<uint32_t, std::vector<Vec2<double>>> places;
  for (size_t region = 0; region < 6; ++region) {
    EXPECT_EQ(borders.ofChart[region].size(), size_t{4 * 12});
    const Chart& chart = tiles.charts[region];
    const Vec2<float> o = chart.coordinates[0], u = chart.coordinates[1] - o, v = chart.coordinates[3] - o;
    for (const BorderPoint& point : borders.ofChart[region]) {
      const Vec2<float> place = (point.place / kTileSide).cast<float>() - o;
      const Vec3<float>& p = tiles.field.mesh.positions[chart.vertices[0]].raw();
      places[point.point].push_back(
          {double{p[0]} + double{place.dot(u)}, double{p[1]} + double{place.dot(v)}});
    }
  }
  for (const auto& [point, all] : places)
    for (const Vec2<double>& place : all) EXPECT_LT((place - all[0]).norm(), 1e-6);
}

TEST(BorderPoints, AreAsCloseOnLongEdgesAsOnShortOnes) {
  const Tiles tiles(1, 1, 0);
  EXPECT_EQ(borderPoints(tiles.field.mesh, tiles.charts, 1.0 / 500).count, size_t{4 * 500});
}

TEST(UnseenTexels, OneColourFillsAllThatIsConnected) {
  Tiles tiles(4, 3, 0);
  tiles.seen[5].isSeen[77] = true;
  tiles.paint([](const Vec2<double>&, const Direction&) { return Vec3<float>(0.25f, 2, 40); });
  const std::vector<uint8_t> isBlack = tiles.fill(tiles.borders());
  EXPECT_EQ(std::ranges::count(isBlack, 1), 0);
  EXPECT_EQ(tiles.written, size_t{12 * 6});
  for (const auto& [key, texture] : tiles.textures)
    for (size_t texel = 0; texel < texture.size(); ++texel) {
      EXPECT_EQ(image::floatOfHalf(texture[texel][1]), 2);
      EXPECT_EQ(texture[texel][3] != 0, key.first == 5 && texel == 77);
    }
}

TEST(UnseenTexels, RegionsThatNothingSeenTouchesAreBlack) {
  Tiles tiles(5, 1, 0);
  tiles.seen[0].isSeen.assign(kTileSide * kTileSide, true);
  // The last two squares have vertices of their own.
  for (const float x : {10.f, 11.f, 12.f})
    for (const float y : {0.f, 1.f}) tiles.field.mesh.positions.emplace_back(x, y, 0.f);
  for (const uint32_t region : {3u, 4u}) {
    const uint32_t first = 12 + 2 * (region - 3);
    tiles.charts[region].vertices = {first, first + 2, first + 3, first + 1};
    tiles.field.regions[region].chart = tiles.charts[region];
  }
  tiles.paint([](const Vec2<double>&, const Direction&) { return Vec3<float>(1, 1, 1); });
  EXPECT_EQ(tiles.fill(tiles.borders()), (std::vector<uint8_t>{0, 0, 0, 1, 1}));
  EXPECT_EQ(tiles.written, size_t{2 * 6});
}

// Radiance of a wave in place and direction, of which a disc across several borders is not seen.
struct HiddenDisc : Tiles {
  HiddenDisc() : Tiles(3, 3, 1) {
    for (size_t region = 0; region < charts.size(); ++region)
      for (size_t texel = 0; texel < seen[region].isSeen.size(); ++texel)
        seen[region].isSeen[texel] = (pointOf(region, texel) - Vec2<double>(1.5, 1.6)).norm() > 1.1;
    paint(truth);
  }
  static Vec3<float> truth(const Vec2<double>& p, const Direction& r) {
    return Vec3<float>::Constant(
        static_cast<float>(2 + std::sin(1.3 * p[0] + 2 * r.x()) + 0.4 * p[1] * r.z()));
  }
};

// Mean difference of texels that a border parts, where neither was seen.
double jumpAcrossBorders(const HiddenDisc& scene) {
  std::map<std::pair<long, long>, std::pair<size_t, size_t>> at; // by texels of the plane
  for (size_t region = 0; region < scene.charts.size(); ++region)
    for (size_t texel = 0; texel < scene.seen[region].isSeen.size(); ++texel) {
      const Vec2<double> p = scene.pointOf(region, texel) * kTileSide;
      at[{std::lround(p[0] - 0.5), std::lround(p[1] - 0.5)}] = {region, texel};
    }
  double sum = 0;
  size_t count = 0;
  for (const auto& [place, a] : at)
    for (const auto& [dx, dy] : {std::pair(1, 0), {0, 1}}) {
      const auto next = at.find({place.first + dx, place.second + dy});
      if (next == at.end() || next->second.first == a.first) continue;
      const auto [region, texel] = next->second;
      if (scene.seen[a.first].isSeen[a.second] || scene.seen[region].isSeen[texel]) continue;
      for (size_t i = 0; i < 18; ++i, ++count)
        sum += std::abs(double{scene.red(a.first, i, a.second)} - double{scene.red(region, i, texel)});
    }
  EXPECT_GT(count, 500u);
  return sum / static_cast<double>(count);
}

TEST(UnseenTexels, AreContinuousAcrossBorders) {
  HiddenDisc scene, apart;
  const auto before = scene.textures;
  EXPECT_EQ(std::ranges::count_if(scene.seen, &SeenRegion::isUnseen), 1); // the one in the middle
  scene.fill(scene.borders());
  // The same without points that regions share.
  BorderPoints own = apart.borders();
  own.count = 0;
  for (auto& points : own.ofChart)
    for (BorderPoint& point : points) point.point = static_cast<uint32_t>(own.count++);
  EXPECT_EQ(std::ranges::count(apart.fill(own), 1), 1);
  const double jump = jumpAcrossBorders(scene), jumpApart = jumpAcrossBorders(apart);
  RecordProperty("jump", std::to_string(jump));
  RecordProperty("jump_apart", std::to_string(jumpApart));
  EXPECT_LT(jump, jumpApart / 10);
  for (const auto& [key, texture] : before)
    for (size_t texel = 0; texel < texture.size(); ++texel)
      if (scene.seen[key.first].isSeen[texel]) {
        ASSERT_EQ(scene.textures[key][texel], texture[texel]);
      }
}

// Borders lie on the centres of texels, but for rounding. One side saw its border, the other just texels
// behind it.
TEST(UnseenTexels, ABorderHasTheRadianceOfTheSideThatSawIt) {
  Tiles tiles(2, 1, 0);
  for (size_t region = 0; region < 2; ++region) {
    for (Vec2<float>& place : tiles.charts[region].coordinates)
      place = (place * (kTileSide - 1) + Vec2<float>::Constant(0.5f)) / kTileSide;
    Chart& chart = tiles.field.regions[region].chart;
    chart.coordinates = tiles.charts[region].coordinates;
    for (Vec2<float>& place : chart.coordinates) place += Vec2<float>(1e-7f, -1e-7f);
  }
  const auto isBehind = [&](size_t texel) { return tiles.pointOf(1, texel)[0] > 1 + 0.5 / kTileSide; };
  for (size_t texel = 0; texel < size_t{kTileSide * kTileSide}; ++texel) {
    tiles.seen[0].isSeen[texel] = true;
    tiles.seen[1].isSeen[texel] = isBehind(texel);
  }
  tiles.paint([](const Vec2<double>& p, const Direction&) {
    return Vec3<float>::Constant(p[0] < 1 + 0.5 / kTileSide ? 1.f : 5.f);
  });
  std::vector<Chart> charts;
  for (const Region& region : tiles.field.regions) charts.push_back(region.chart);
  tiles.fill(borderPoints(tiles.field.mesh, charts, 1.0 / kTileSide));
  for (size_t i = 0; i < 6; ++i)
    for (size_t texel = 0; texel < size_t{kTileSide * kTileSide}; ++texel) {
      // Corners also have points of edges that this side alone saw; pointOf() shrinks such charts.
      const double y = tiles.pointOf(1, texel)[1];
      if (!isBehind(texel) && y > 0.01 && y < 0.8) {
        EXPECT_NEAR(tiles.red(1, i, texel), 1, 2e-3);
      }
    }
}

// Three of four squares around a point are seen: one with radiance 1, two with 9. In direction 1, the latter
// have no texture, or none that a photograph shows.
TEST(UnseenTexels, RadianceThatNoPhotographShowsCountsWhereThereIsNoOther) {
  for (const bool hasTexture : {false, true}) {
    Tiles tiles(2, 2, 1);
    for (const size_t region : {1u, 2u, 3u}) tiles.seen[region].isSeen.assign(kTileSide * kTileSide, true);
    tiles.paint(
        [&](const Vec2<double>& p, const Direction&) { return Vec3<float>::Constant(p[1] > 1 ? 9.f : 1.f); });
    for (const size_t region : {2u, 3u})
      if (hasTexture)
        for (Texel& texel : tiles.textures[{region, 1}]) texel[3] = 0;
      else
        tiles.seen[region].isUsed[1] = 0;
    tiles.fill(tiles.borders());
    size_t corner = 0;
    for (size_t texel = 0; texel < size_t{kTileSide * kTileSide}; ++texel)
      if ((tiles.pointOf(0, texel) - Vec2<double>(1, 1)).norm() <
          (tiles.pointOf(0, corner) - Vec2<double>(1, 1)).norm())
        corner = texel;
    // The point itself, and half of the next ones on both edges.
    EXPECT_NEAR(tiles.red(0, 0, corner), ((1 + 9 + 9) / 3.0 + 0.5 + 4.5) / 2, 5e-3);
    EXPECT_NEAR(tiles.red(0, 1, corner), (1 + 0.5 + 4.5) / 2, 2e-2);
  }
}

// A region has fewer directions than its neighbours, which see it by its hat functions.
TEST(UnseenTexels, KeepTheirDirections) {
  Tiles tiles(2, 1, 1);
  tiles.field.directionMeshes.emplace_back(octahedronDirections(0));
  tiles.field.regions[0].directionMesh = 1;
  tiles.seen[0].isUsed.assign(6, 1);
  tiles.seen[0].isSeen.assign(kTileSide * kTileSide, true);
  const auto truth = [](const Vec2<double>&, const Direction& r) {
    return Vec3<float>::Constant(static_cast<float>(5 + r.x() + 2 * r.y() + 3 * r.z()));
  };
  tiles.paint(truth);
  tiles.fill(tiles.borders());
  for (size_t i = 0; i < 18; ++i) {
    const Direction& r = tiles.base().directions()[i];
    const double flat = std::abs(r.x()) + std::abs(r.y()) + std::abs(r.z()); // on the octahedron
    EXPECT_NEAR(tiles.red(1, i, 70), 5 + (r.x() + 2 * r.y() + 3 * r.z()) / flat, 5e-3);
  }
}

TEST(UnseenTexels, BitsDoNotDependOnTheNumberOfThreads) {
  HiddenDisc many, one;
  many.fill(many.borders());
  const tbb::global_control single(tbb::global_control::max_allowed_parallelism, 1);
  one.fill(one.borders());
  EXPECT_EQ(one.textures, many.textures);
}

} // namespace
} // namespace surflect::slf
