#include "render/lightfield/lumigraph/build.h"

#include "render/lightfield/lumigraph/slab.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"
#include "tests/support/box_capture.h"
#include "tests/support/synthetic_capture.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace surflect::lumigraph {

namespace {

// A line from node A meets the object at depth d, but is corrected for depth d + e: node B is then asked
// where its line to the wrong point crosses the uv plane, and shows another point.
TEST(DepthError, IsTheOffsetOfIntersectedRays) {
  std::mt19937 random(1);
  for (const Slab& slab : slabsAround(bumpySphere(0.3), {.nodes = 4, .texels = 100000, .distance = 3}))
    for (int n = 0; n < 50; ++n) {
      std::uniform_real_distribution<double> within(0, 1);
      const double p = std::abs(slab.stPlane - slab.uvPlane);
      const double d = p + within(random) - 0.5, e = 0.2 * (within(random) - 0.5);
      const Line a = slab.lineOf({1, 2, slab.width * within(random), slab.height * within(random)});
      const double slant = std::abs(a.direction.raw()[slab.axis]); // depth along the line, per length
      const Point truth = a.origin + d / slant * a.direction;
      const Point wrong = a.origin + (d + e) / slant * a.direction;
      const Point b = slab.stPoint(2, 2);
      const double shown = slab.coordinatesOf(truth, b).u, asked = slab.coordinatesOf(wrong, b).u;
      EXPECT_NEAR(asked - shown, ghostOffset(p, e, slab.stSpacing[0], d, slab.uvSpacing), 1e-9);
      EXPECT_NEAR(slab.coordinatesOf(truth, a.origin).u, slab.coordinatesOf(wrong, a.origin).u, 1e-9);
    }
}

TEST(DepthError, GrowsWithTheRatioOfGridSpacings) {
  EXPECT_DOUBLE_EQ(ghostOffset(4, 0.1, 2, 3, 0.01), 2 * ghostOffset(4, 0.1, 1, 3, 0.01));
  EXPECT_DOUBLE_EQ(ghostOffset(4, 0.1, 2, 3, 0.01), 2 * ghostOffset(4, 0.1, 2, 3, 0.02));
  EXPECT_EQ(ghostOffset(4, 0, 2, 3, 0.01), 0);
}

// A square plate, and the same plate moved down: lines meet both where planes are crossed within the squares.
TEST(DepthErrors, OfAPlateThatIsMovedAreThoseOfPlanes) {
  constexpr float kMoved = 0.1f;
  const auto plateAt = [](float z) {
    return TriangleMesh{{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}}, {{0, 1, 2}, {0, 2, 3}}};
  };
  const Slabs slabs = slabsAround(bumpySphere(0), {.nodes = 3, .texels = 20000, .distance = 4});
  const DepthErrors errors = depthErrors(slabs, RayCaster<AcquisitionSpace>(plateAt(0)), plateAt(-kMoved), 2);
  size_t lines = 0;
  double depth = 0, offset = 0, worstDepth = 0, worstOffset = 0;
  for (const Slab& slab : slabs)
    for (int node = 0; node < 9; ++node)
      for (int y = 1; y < slab.height; y += 2)
        for (int x = 1; x < slab.width; x += 2) {
          const Line line = slab.lineOf({double(node % 3), double(node / 3), x + 0.5, y + 0.5});
          const Vec3<double> o = line.origin.raw(), r = line.direction.raw();
          const auto reach = [&](double z) { return (z - o[2]) / r[2]; };
          const auto isWithin = [&](double z) {
            return reach(z) > 0 && (o + reach(z) * r).head<2>().cwiseAbs().maxCoeff() < 1;
          };
          if (r[2] == 0 || !isWithin(0) || !isWithin(-kMoved)) continue;
          const double d = reach(0) * std::abs(r[slab.axis]), e = reach(-kMoved) * std::abs(r[slab.axis]) - d;
          const double ghost =
              std::abs(ghostOffset(std::abs(slab.stPlane - slab.uvPlane), e,
                                   std::max(slab.stSpacing[0], slab.stSpacing[1]), d, slab.uvSpacing));
          ++lines, depth += std::abs(e), offset += ghost;
          worstDepth = std::max(worstDepth, std::abs(e)), worstOffset = std::max(worstOffset, ghost);
        }
  EXPECT_GT(lines, 500u);
  EXPECT_EQ(errors.lines, lines);
  EXPECT_NEAR(errors.meanDepth, depth / double(lines), 1e-5);
  EXPECT_NEAR(errors.worstDepth, worstDepth, 1e-5);
  EXPECT_NEAR(errors.meanOffset, offset / double(lines), 1e-4);
  EXPECT_NEAR(errors.worstOffset, worstOffset, 1e-4);
}

TEST(DepthErrors, OfTheObjectItselfAreNone) {
  const TriangleMesh object = bumpySphere(0.3);
  const DepthErrors errors = depthErrors(slabsAround(object, {.nodes = 2, .texels = 20000}),
                                         RayCaster<AcquisitionSpace>(object), object, 3);
  EXPECT_GT(errors.lines, 500u);
  EXPECT_EQ(errors.worstOffset, 0);
}

} // namespace

namespace {

// Line from outside through a point of the unit sphere, towards it along -towards.
Line lineTo(const Vec3<double>& p, const Vec3<double>& towards) {
  return {assume<Point>(Vec3<double>(p + 10 * towards)), assume<Direction>(Vec3<double>(-towards))};
}

class ResamplerTest : public ::testing::Test {
protected:
  const lightfield::Views& photographed(const studio::Studio& studio) {
    studio::photograph(studio, folder_.path());
    return views_.emplace(folder_.path());
  }
  image::TemporaryFolder folder_;
  std::optional<lightfield::Views> views_;
};

TEST_F(ResamplerTest, GivesTheRadianceOfAMatteObject) {
  const lightfield::Views& views = photographed({.cameras = 30, .lights = 0, .size = 64});
  for (const bool nearest : {false, true}) {
    const Resampler resampler(views, {.nearest = nearest});
    std::mt19937 random(1);
    double worst = 0;
    for (int n = 0; n < 300; ++n) {
      const Vec3<double> p = randomUnit(random);
      const Vec3<double> towards = (p + 0.7 * randomUnit(random)).normalized();
      const Sample sample = resampler.at(lineTo(p, towards));
      ASSERT_EQ(sample.kind, Sample::Kind::seen);
      const Rgb truth = studio::fixedRadiance(p.cast<float>());
      worst = std::max(
          worst, static_cast<double>(
                     (sample.color - Eigen::Vector3f(truth.r, truth.g, truth.b)).cwiseAbs().maxCoeff()));
    }
    EXPECT_LE(worst, 0.03);
  }
}

TEST_F(ResamplerTest, MissesWhatIsNotThere) {
  const Resampler resampler(photographed({.cameras = 4, .lights = 0, .size = 16}), {});
  EXPECT_EQ(resampler.at({Point(0, 5, 1.5), Direction(0, -1, 0)}).kind, Sample::Kind::missed);
}

// Only the first view is for training; it looks from one side.
TEST_F(ResamplerTest, AsksTrainingViewsAloneAndTellsWhereNoneSees) {
  const lightfield::Views& views =
      photographed({.cameras = 6, .lights = 0, .size = 40, .split = [](size_t view, size_t) {
                      return std::optional(view == 0 ? capture::Split::train : capture::Split::test);
                    }});
  const Resampler resampler(views, {});
  const Vec3<double> front = views.camera(0).center().raw().normalized();
  EXPECT_EQ(resampler.at(lineTo(front, front)).kind, Sample::Kind::seen);
  EXPECT_EQ(resampler.at(lineTo(-front, -front)).kind, Sample::Kind::unseen);
}

TEST_F(ResamplerTest, SeesALineThroughACameraAsItsPhotographDoes) {
  const lightfield::Views& views = photographed({.cameras = 20, .lights = 0, .size = 48});
  const Resampler blending(views, {}), nearest(views, {.nearest = true});
  const lightfield::Photographs photographs(views);
  for (size_t view = 0; view < views.size(); ++view) {
    const Point center = views.camera(view).center();
    for (const double offset : {0., 0.2, 0.4}) {
      const Direction direction = normalized(Point(offset, 0, 0) - center);
      const auto hit = views.rays().firstHit(center, direction);
      const auto shown = photographs.at(view, *views.camera(view).project(center + hit->distance * direction),
                                        hit->distance, 1);
      EXPECT_LE((nearest.at({center, direction}).color - shown->radiance).norm(), 1e-5f);
      EXPECT_LE((blending.at({center, direction}).color - shown->radiance).norm(), 1e-4f);
    }
  }
}

// A bright plate above a dark table, photographed from above and from the side.
TEST_F(ResamplerTest, AnOccluderDoesNotShowOnWhatLiesBehindIt) {
  TriangleMesh mesh;
  boxes::addBox(mesh, {-0.8f, -0.8f, -0.2f}, {0.8f, 0.8f, -0.1f});
  boxes::addBox(mesh, {-0.3f, -0.3f, 0.2f}, {0.3f, 0.3f, 0.3f});
  const auto radiance = [](const Vec3<double>& place, const Vec3<double>&) {
    return place[2] > 0 ? Rgb{100, 100, 100} : Rgb{1, 1, 1};
  };
  boxes::writeCapture(mesh, radiance, {{{0, 0, 1}, {0.1, 0.1, 1}, {1, 0, 0.6}}, 96, 0.35}, folder_.path());
  const lightfield::Views& views = views_.emplace(folder_.path());
  const Point camera = views.camera(0).center();
  for (const bool onlyNearest : {false, true}) {
    const Resampler resampler(views, {.nearest = onlyNearest});
    std::mt19937 random(1);
    size_t hiddenFromAbove = 0, table = 0, plate = 0;
    for (int n = 0; n < 2000; ++n) {
      std::uniform_real_distribution<double> within(-0.75, 0.75);
      const Point target(within(random), within(random), -0.1);
      const Direction towards = normalized(Point(2 + within(random), within(random), 3) - target);
      const Line line{target + 10. * towards, -towards};
      const auto hit = views.rays().firstHit(line.origin, line.direction);
      const bool isPlate = (line.origin + hit->distance * line.direction).z() > 0;
      const Sample sample = resampler.at(line);
      if (sample.kind != Sample::Kind::seen) continue;
      EXPECT_NEAR(sample.color[0], isPlate ? 100 : 1, isPlate ? 0.1 : 1e-3);
      ++(isPlate ? plate : table);
      if (!isPlate &&
          views.rays().occluded(target, normalized(camera - target), 0.01, length(camera - target)))
        ++hiddenFromAbove;
    }
    EXPECT_GT(table, 500u);
    EXPECT_GT(plate, 100u);
    EXPECT_GT(hiddenFromAbove, 20u);
  }
}

TEST_F(ResamplerTest, FillsPicturesBesideTheObjectWithoutBlack) {
  const lightfield::Views& views = photographed({.cameras = 20, .lights = 0, .size = 40});
  const Resampler resampler(views, {});
  const Slab slab = slabsAround(views.mesh(), {.nodes = 3, .texels = 40000})[0];
  Tally tally;
  const std::vector<Texel> picture = resampler.picture(slab, 1, 1, tally);
  ASSERT_EQ(picture.size(), slab.nodeTexels());
  size_t covered = 0;
  for (const Texel& texel : picture) {
    EXPECT_TRUE(texel[3] == 0 || texel[3] == image::nearestHalf(1));
    covered += texel[3] != 0;
    EXPECT_GT(image::floatOfHalf(texel[0]), 0.1f); // the darkest radiance is 0.18
  }
  EXPECT_EQ(covered, tally.seen + tally.unseen);
  EXPECT_EQ(picture.size() - covered, tally.missed);
  EXPECT_EQ(tally.unseen, 0u);
  EXPECT_GT(tally.missed, 0u);
}

TEST_F(ResamplerTest, ANumberOfViewsOutOfRangeIsAnError) {
  const lightfield::Views& views = photographed({.cameras = 4, .lights = 0, .size = 16});
  EXPECT_THROW(Resampler(views, {.views = 0}), Error);
  EXPECT_THROW(Resampler(views, {.views = 17}), Error);
}

} // namespace

} // namespace surflect::lumigraph
