#include "render/surfels/cut.h"

#include "tests/render/films.h"
#include "warp/deform.h"

#include <tbb/task_arena.h>

namespace surflect::surfels {
namespace {

using studio::filmOf;
using studio::noWarp;
using studio::pictureSize;

class CutOfSphere : public studio::PackedSphere<2000> {
protected:
  const std::vector<scene::ShotLight> lights{scene::ShotPointLight{{2, 1, 2}, {9, 8, 7}}};
  const warp::WarpPointer warp = warp::chainWarp([] {
    std::vector<warp::WarpPointer> parts;
    parts.push_back(warp::scaleWarp({1, 1.6, 0.7}, Vec3<double>::Zero()));
    parts.push_back(warp::twistWarp({0, 1, 0}, Angle::fromDegrees(40), {0, 0, 0}));
    return parts;
  }());
  LevelsOfDetail detail = levelsOfDetail(model().cloud);
  CutLevels levels = cutLevels(model().cloud, detail);

  image::Image filmAt(double surfelSize) {
    options.surfelSize = surfelSize;
    return renderFrame(model(), {*warp, camera, lights}, options, workspace).color;
  }
  FrameOptions options;
  FrameWorkspace workspace{model(), size_t{1} << 28};
};

TEST_F(CutOfSphere, StretchIsThatOfFiniteDifferencesThroughAnyLens) {
  const DeformedCloud deformed = warp::deform(model().cloud, *warp);
  auto distorting = camera, orthographic = camera;
  distorting.lens.k1 = 0.1, distorting.lens.k2 = -0.05, distorting.lens.p1 = 0.02;
  orthographic.lens.model = capture::Lens::Model::orthographic;
  orthographic.lens.focalX = 70, orthographic.lens.focalY = 50;
  for (const auto& seen : {camera, distorting, orthographic})
    for (size_t i = 0; i < deformed.size(); i += 50) {
      const auto pixel = [&](const Vec3<float>& offset) {
        const auto p = assume<Point3<ObjectSpace, double>>(
            Vec3<double>((deformed.p[i].raw().cast<double>() + 1e-4 * offset.cast<double>())));
        const auto at = seen.project(p);
        return Vec2<double>(at->x, at->y);
      };
      Eigen::Matrix2d jacobian;
      jacobian.col(0) = (pixel(deformed.u[i].raw()) - pixel(-deformed.u[i].raw())) / 2e-4;
      jacobian.col(1) = (pixel(deformed.v[i].raw()) - pixel(-deformed.v[i].raw())) / 2e-4;
      const Eigen::JacobiSVD<Eigen::Matrix2d> svd(jacobian);
      const double largest = svd.singularValues()[0],
                   smallest = std::max(svd.singularValues()[1], kLeastTilt * largest);
      EXPECT_NEAR(pixelsPerLength(seen, deformed, i), std::sqrt(largest * smallest), 1e-4 * largest);
    }
}

TEST_F(CutOfSphere, ALevelHalvesTheSurfelsAndTheirSizeIsKept) {
  EXPECT_EQ(levelFor(1, 1), 0);
  EXPECT_EQ(levelFor(2, 1), 0);
  EXPECT_NEAR(levelFor(1, 2), 2, 1e-12);
  EXPECT_NEAR(levelFor(0.5, std::sqrt(2) / 2), 1, 1e-12);
  EXPECT_EQ(levelFor(0, 3), 0);
}

// Each surfel by itself.
TEST_F(CutOfSphere, IsThatOfOneSurfelAfterTheOther) {
  const SurfelCloud& cloud = model().cloud;
  const DeformedCloud deformed = warp::deform(cloud, *warp);
  for (const double surfelSize : {1.5, 3.0, 400.0}) {
    const Cut cut = cutFor(cloud, levels, *warp, camera, surfelSize);
    size_t next = 0;
    for (size_t patch = 0; patch < levels.patches.size(); ++patch) {
      const uint32_t middle = levels.patches.middle[patch];
      const double level =
          std::min(levelFor(cloud.radius[middle] * pixelsPerLength(camera, deformed, middle), surfelSize),
                   static_cast<double>(detail.count - 1));
      for (uint32_t i = levels.patches.first[patch]; i < levels.patches.first[patch + 1]; ++i) {
        const auto splat =
            splatAt(detail.of(i), static_cast<size_t>(level), static_cast<float>(level - std::floor(level)));
        if (!splat) continue;
        ASSERT_LT(next, cut.surfels.size());
        EXPECT_EQ(cut.surfels[next], i);
        EXPECT_EQ(cut.cloud.p0[next], cloud.p0[i]);
        EXPECT_EQ(cut.cloud.r0[next].x, cloud.r0[i].x);
        EXPECT_NEAR(cut.cloud.radius[next] / splat->radius, 1, 1e-6);
        EXPECT_NEAR(cut.cloud.coverage[next] / splat->coverage, 1, 1e-6);
        ++next;
      }
    }
    EXPECT_EQ(next, cut.surfels.size());
    EXPECT_LT(next, cloud.size());
    EXPECT_FALSE(cut.isWhole);
  }
}

TEST_F(CutOfSphere, OfSurfelsLargerThanAskedIsTheFullFrame) {
  EXPECT_TRUE(cutFor(model().cloud, levels, *warp, camera, 0.1).isWhole);
  EXPECT_EQ(filmAt(0.1).values, filmAt(0).values);
}

TEST_F(CutOfSphere, WithoutStoredLevelsThePictureIsTheSame) {
  model::Model older = model::openModel(model().folder);
  ASSERT_TRUE(older.levels);
  older.levels.reset();
  options.surfelSize = 2;
  FrameWorkspace olderWorkspace{older, size_t{1} << 28};
  EXPECT_EQ(renderFrame(older, {*warp, camera, lights}, options, olderWorkspace).color.values,
            filmAt(2).values);
}

// No popping: each pixel changes by little from one size to the next, while patches cross levels.
TEST_F(CutOfSphere, ThePictureIsAContinuousFunctionOfTheSize) {
  image::Image last = filmAt(1.5);
  const size_t drawn = workspace.stats.surfels;
  double largest = 0;
  for (double size = 1.5; size < 3; size *= 1.005) {
    image::Image film = filmAt(size);
    largest = std::max(largest, studio::largestDifference(film, last));
    last = std::move(film);
  }
  EXPECT_LT(workspace.stats.surfels, drawn / 2);
  EXPECT_LT(largest, 0.04);
}

TEST_F(CutOfSphere, SameBitsForAnyThreadsWithAllAovsAndPatches) {
  options.aovs.assign(scene::aovNames.begin(), scene::aovNames.end());
  options.surfelSize = 2.2;
  options.surfelsPerQuery = 8;
  const FrameLayers expected = renderFrame(model(), {*warp, camera, lights}, options, workspace);
  EXPECT_LT(workspace.stats.surfels, model().cloud.size() / 2);
  for (const int threads : {1, 2})
    tbb::task_arena(threads).execute([&] {
      const FrameLayers film = filmOf(model(), *warp, camera, lights, options);
      EXPECT_EQ(film.color.values, expected.color.values);
      for (const auto& [name, image] : expected.aovs)
        EXPECT_EQ(film.aovs.at(name).values, image.values) << name;
    });
}

} // namespace
} // namespace surflect::surfels
