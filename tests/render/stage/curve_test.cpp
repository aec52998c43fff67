#include "render/stage/curve.h"

#include "render/stage/shapes.h"
#include "surfel/base/error.h"
#include "tests/render/stage/surfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace surflect::stage {

namespace {

using Vector = Vec3<double>;
constexpr double kPi = std::numbers::pi;

std::vector<CurvePoint> randomPoints(std::mt19937& random, size_t count) {
  std::uniform_real_distribution<double> coordinate(-1, 1), radius(0.1, 0.3);
  std::vector<CurvePoint> points;
  for (size_t i = 0; i < count; ++i) {
    const double x = coordinate(random), y = coordinate(random), z = coordinate(random);
    points.push_back({Vector(x, y, z + 2. * static_cast<double>(i)), radius(random)});
  }
  return points;
}

std::vector<CurvePoint> circle(size_t count, bool repeatsFirst) {
  std::vector<CurvePoint> points;
  for (size_t i = 0; i < count; ++i) {
    const double phi = 2 * kPi * static_cast<double>(i) / static_cast<double>(count);
    points.push_back({Vector(std::cos(phi), 0, std::sin(phi)), 0.1});
  }
  if (repeatsFirst) points.push_back(points.front());
  return points;
}

TEST(SmoothCurve, GoesThroughItsPoints) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const auto points = randomPoints(random, 5);
    const SmoothCurve curve(points, trial % 2 == 1);
    EXPECT_EQ(curve.at(0).position, points.front().position);
    EXPECT_EQ(curve.at(1).position, points[trial % 2 == 1 ? 0 : 4].position);
    for (const CurvePoint& p : points) {
      double nearest = 1;
      for (int i = 0; i <= 2000; ++i)
        nearest = std::min(nearest, (curve.at(i / 2000.).position - p.position).norm());
      EXPECT_LT(nearest, 0.01);
    }
  }
}

TEST(SmoothCurve, IsALineThroughPointsOnALine) {
  const SmoothCurve curve({{Vector(0, 0, 0), 1}, {Vector(1, 2, 2), 2}, {Vector(4, 8, 8), 5}}, false);
  EXPECT_NEAR(curve.length(), 12, 1e-9);
  for (int i = 0; i <= 10; ++i) {
    const CurvePoint p = curve.at(i / 10.);
    EXPECT_LT((p.position - Vector(4, 8, 8) * i / 10.).norm(), 1e-9);
    EXPECT_NEAR(p.radius, 1 + 4 * i / 10., 1e-9);
    EXPECT_LT((curve.direction(i / 10.) - Vector(1, 2, 2) / 3).norm(), 1e-9);
  }
}

TEST(SmoothCurve, ConvergesToTheCircleOfItsPoints) {
  const auto error = [](size_t count) {
    return std::abs(SmoothCurve(circle(count, false), true).length() - 2 * kPi);
  };
  EXPECT_LT(error(32), 1e-2);
  EXPECT_GT(error(8) / error(32), 12); // second order, before the error of chords
}

TEST(SmoothCurve, TurnsWithoutCorners) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 10; ++trial) {
    const SmoothCurve curve(randomPoints(random, 6), trial % 2 == 1);
    for (int i = 0; i < 20'000; ++i)
      EXPECT_GT(curve.direction(i / 20'000.).dot(curve.direction((i + 1) / 20'000.)), 0.99);
    EXPECT_GT(trial % 2 == 1 ? curve.direction(0).dot(curve.direction(1)) : 1, 1 - 1e-9);
  }
}

TEST(SmoothCurve, AdvancesEvenly) {
  std::mt19937 random(5);
  const SmoothCurve curve(randomPoints(random, 6), false);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR((curve.at((i + 1) / 1000.).position - curve.at(i / 1000.).position).norm(),
                curve.length() / 1000, 1e-3 * curve.length() / 10);
}

TEST(SmoothCurve, RefusesPointsThatMakeNone) {
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}}, false), Error);
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}, {Vector(1, 0, 0)}}, true), Error);
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}, {Vector(0, 0, 0)}}, false), Error);
  EXPECT_THROW(SmoothCurve({{Vector(0, 0, 0)}, {Vector(1, 0, 0)}, {Vector(0, 0, 0)}}, true), Error);
}

TEST(CurveFrames, AreRightHandedAndDoNotTurnOnAPlanarCurve) {
  std::vector<CurvePoint> arc = circle(64, false);
  arc.resize(40);
  for (const CurveFrame& frame : framesAlong(arc, false)) {
    EXPECT_LT((frame.normal.cross(frame.binormal) - frame.tangent).norm(), 1e-12);
    EXPECT_NEAR(frame.tangent.norm(), 1, 1e-12);
    // The curve's plane stays where it is in the frame.
    EXPECT_NEAR(std::abs(frame.binormal.y()), 1, 1e-9);
  }
}

TEST(CurveFrames, CloseAndSpreadWhatIsLeft) {
  std::vector<CurvePoint> knot; // out of the plane, so that frames come back turned
  for (int i = 0; i <= 200; ++i) {
    const double phi = 2 * kPi * (i % 200) / 200;
    knot.push_back(
        {Vector(std::cos(phi), std::sin(phi), 0.5 * std::sin(2 * phi) + 0.3 * std::cos(phi)), 0.1});
  }
  const auto frames = framesAlong(knot, true);
  EXPECT_EQ(frames.front().normal, frames.back().normal);
  EXPECT_EQ(frames.front().tangent, frames.back().tangent);
  for (size_t i = 0; i + 1 < frames.size(); ++i) EXPECT_GT(frames[i].normal.dot(frames[i + 1].normal), 0.99);
}

} // namespace

namespace {

using Vector = Vec3<double>;

std::vector<CurvePoint> ring(size_t count, double radius, double thickness) {
  std::vector<CurvePoint> points;
  for (size_t i = 0; i < count; ++i) {
    const double phi = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(count);
    points.push_back({Vector(radius * std::cos(phi), radius * std::sin(phi), 0), thickness});
  }
  return points;
}

const std::vector<CurvePoint> bow{
    {Vector(0, 0, 0), 0.1}, {Vector(0.5, 0, 0.4), 0.12}, {Vector(1, 0.3, 0.2), 0.05}};

TEST(Tube, RoundALineIsACylinderWithHalfSpheres) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 5; ++trial) {
    const double x = normal(random), y = normal(random), z = normal(random);
    const Vector way(x, y, z);
    const double r = 0.2, l = way.norm();
    const Surface rod =
        tube(std::vector<CurvePoint>{{Vector(1, 1, 1), r}, {Vector(1, 1, 1) + way, r}}, false, 128);
    EXPECT_TRUE(isClosed(rod.mesh));
    EXPECT_NEAR(volumeOf(rod.mesh), std::numbers::pi * r * r * l + 4 * std::numbers::pi / 3 * r * r * r,
                2e-3 * (l + r) * r * r * std::numbers::pi);
    EXPECT_NEAR(areaOf(rod.mesh), 2 * std::numbers::pi * r * l + 4 * std::numbers::pi * r * r,
                2e-3 * 2 * std::numbers::pi * r * (l + 2 * r));
    EXPECT_LT(largestTilt(rod), 0.06);
    for (size_t i = 0; i < rod.tangents.size(); ++i) { // along the rod, but at its round ends
      const double along =
          (rod.mesh.positions[i].cast<double>().raw() - Vector(1, 1, 1)).dot(way.normalized());
      if (along > 1e-6 && along < l - 1e-6) {
        EXPECT_NEAR(rod.tangents[i].raw().dot(way.normalized()), 1, 1e-9);
      }
    }
  }
}

TEST(Tube, RoundACircleIsATorus) {
  const double big = 1, small = 0.25;
  const Surface torus = tube(ring(64, big, small), true, 256);
  EXPECT_TRUE(isClosed(torus.mesh));
  EXPECT_NEAR(volumeOf(torus.mesh), 2 * std::numbers::pi * std::numbers::pi * big * small * small, 2e-3);
  EXPECT_NEAR(areaOf(torus.mesh), 4 * std::numbers::pi * std::numbers::pi * big * small, 1e-2);
  for (size_t i = 0; i < torus.tangents.size(); ++i) EXPECT_NEAR(torus.tangents[i].raw().z(), 0, 1e-2);
}

TEST(Tube, TaperedAndCurvedHasTheNormalsOfItsTriangles) {
  const Surface coarse = tube(bow, false, 32), fine = tube(bow, false, 128);
  EXPECT_TRUE(isClosed(fine.mesh));
  EXPECT_LT(largestLift(fine), 1e-9);
  EXPECT_LT(largestTilt(coarse), 0.4);
  EXPECT_LT(largestTilt(fine), 0.15);
}

TEST(Tube, EndsInAPointWhereItHasNoThickness) {
  const Surface hair =
      tube(std::vector<CurvePoint>{{Vector(0, 0, 0), 0.1}, {Vector(0, 0, 1), 0}}, false, 128);
  EXPECT_TRUE(isClosed(hair.mesh));
  EXPECT_NEAR(volumeOf(hair.mesh), std::numbers::pi * 0.01 / 3 + 2 * std::numbers::pi / 3 * 0.001, 2e-5);
}

TEST(Braid, StrandsPassOverEachOtherInTurn) {
  const BraidShape shape{6, 12};
  const Surface plait =
      braid(std::vector<CurvePoint>{{Vector(0, 0, 0), 0.1}, {Vector(2, 0, 0), 0.1}}, false, shape);
  EXPECT_TRUE(isClosed(plait.mesh));
  // The braid is as wide as twice the radius along z, and flatter along y; its tangents run along x on
  // average.
  Eigen::AlignedBox3f bounds;
  for (const auto& p : plait.mesh.positions) bounds.extend(p.raw());
  EXPECT_NEAR(bounds.sizes().z(), 0.2, 0.02);
  EXPECT_NEAR(bounds.sizes().y(), 0.16, 0.02);
  Vector sum = Vector::Zero();
  for (const auto& t : plait.tangents) sum += t.raw();
  EXPECT_GT(sum.normalized().x(), 0.99);
}

TEST(Braid, ClosesRoundARingAndIsTheSameForASeed) {
  const BraidShape shape{8, 10, 5}, other{8, 10, 6};
  const auto points = ring(8, 1, 0.1);
  const Surface one = braid(points, true, shape), again = braid(points, true, shape),
                differs = braid(points, true, other);
  EXPECT_TRUE(isClosed(one.mesh));
  EXPECT_EQ(one.mesh.positions, again.mesh.positions);
  EXPECT_NE(one.mesh.positions, differs.mesh.positions);
}

TEST(Braid, TooManyTrianglesAreAnError) { EXPECT_THROW(braid(bow, false, {10'000, 1000}), Error); }

} // namespace

namespace {

TEST(Fur, StandsOnTheSkinAlongItsNormals) {
  const Surface skin = sphere({0, 0, 0}, 1, 64);
  const Surface hairs = fur(skin, {.hairs = 500, .length = 0.2, .radius = 0.005});
  EXPECT_TRUE(isClosed(hairs.mesh));
  EXPECT_GT(volumeOf(hairs.mesh), 0);
  for (size_t i = 0; i < hairs.mesh.positions.size(); ++i) {
    const Vec3<double> p = hairs.mesh.positions[i].cast<double>().raw(), t = hairs.tangents[i].raw();
    EXPECT_LT(p.norm(), 1.2 + 1e-4);
    EXPECT_GT(p.norm(), 0.99); // the root's half sphere, and the facets of the skin
    if (p.norm() > 1.01 && t.norm() > 0) {
      EXPECT_GT(t.normalized().dot(p.normalized()), 0.98);
    }
  }
}

TEST(Fur, IsCombed) {
  const Surface skin = box({0, 0, 0}, {1, 1, 1}, 4);
  const Vec3<double> comb(0, 0, -0.5);
  const Surface hairs = fur(skin, {.hairs = 300, .length = 0.2, .radius = 0.002, .comb = comb});
  const Surface straight = fur(skin, {.hairs = 300, .length = 0.2, .radius = 0.002});
  ASSERT_EQ(hairs.mesh.positions.size(), straight.mesh.positions.size());
  Vec3<double> sum = Vec3<double>::Zero();
  double lowest = 0;
  for (size_t i = 0; i < hairs.mesh.positions.size(); ++i) {
    const Vec3<double> moved =
        hairs.mesh.positions[i].cast<double>().raw() - straight.mesh.positions[i].cast<double>().raw();
    lowest = std::min(lowest, moved.z());
    sum += moved;
  }
  EXPECT_NEAR(lowest, -0.1, 0.004); // the tips, by half a length
  EXPECT_GT(sum.normalized().dot(comb.normalized()), 0.999);
}

TEST(Fur, IsEvenOverTheArea) {
  // Boxes with faces of areas 2, 2, 2, 2, 1, 1 (z up: the small ones)
  const Surface skin = box({0, 0, 0}, {1, 1, 2}, 3);
  const int count = 6000;
  const Surface hairs = fur(skin, {.hairs = count, .length = 0.01, .radius = 1e-4});
  const size_t each = hairs.mesh.positions.size() / count;
  int ends = 0;
  for (int i = 0; i < count; ++i)
    ends += std::abs(hairs.mesh.positions[static_cast<size_t>(i) * each].z()) > 0.9999f;
  const double expected = count * 2. / 10, deviation = std::sqrt(expected * 0.8);
  EXPECT_NEAR(ends, expected, 4 * deviation);
}

TEST(Fur, HasTheTextureOfItsRootAndTheSameHairsForASeed) {
  const Surface skin = sphere({0, 0, 0}, 1, 64);
  const FurShape shape{.hairs = 20, .length = 0.2, .radius = 0.005, .disorder = 0.5};
  const Surface one = fur(skin, shape), again = fur(skin, shape);
  EXPECT_EQ(one.mesh.positions, again.mesh.positions);
  const size_t each = one.mesh.positions.size() / 20;
  for (size_t i = 0; i < one.mesh.positions.size(); ++i)
    EXPECT_EQ(one.textureCoordinates[i], one.textureCoordinates[i / each * each]);
  EXPECT_NE(one.textureCoordinates[0], one.textureCoordinates[each]);
  EXPECT_THROW(fur(skin, {.hairs = 1'000'000, .length = 1, .radius = 1}), Error);
}

} // namespace

} // namespace surflect::stage
