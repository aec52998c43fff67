#include "srf/reflectance/shared_reflectance.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numbers>
#include <numeric>

namespace surflect::reflectance {
namespace {

// A disc whose right half is brushed, along circles about its middle, and whose left half is matte. Frames
// are turned at random.
struct Disc {
  std::vector<Point3<AcquisitionSpace>> places;
  std::vector<SurfelFrame> frames;
  std::vector<Rgb> gains;
  std::vector<double> fibres; // in each frame
  PhotographArrays photographs;

  const planted::Material& materialOf(size_t surfel) const {
    return places[surfel].x() > 0 ? planted::kBrushed : planted::kMatte;
  }
};

Disc randomDisc(size_t surfels, size_t photographs, std::mt19937& random) {
  std::uniform_real_distribution<double> any(-1, 1);
  Disc disc;
  while (disc.places.size() < surfels) {
    const double x = any(random), y = any(random), turn = std::numbers::pi * any(random);
    if (std::hypot(x, y) > 1 || std::hypot(x, y) < 0.2) continue;
    disc.places.push_back(assume<Point3<AcquisitionSpace>>(Vec3<double>(x, y, 0)));
    disc.frames.emplace_back(
        Eigen::AngleAxisf(static_cast<float>(turn), Vec3<float>::UnitZ()).toRotationMatrix());
    disc.gains.push_back(planted::randomGain(random));
    disc.fibres.push_back(std::atan2(x, -y) - turn);
    const size_t s = disc.places.size() - 1;
    planted::addSurfel(disc.photographs, disc.materialOf(s), disc.gains[s], photographs, random,
                       planted::aboutNormal(disc.fibres[s]));
  }
  return disc;
}

TEST(SharedReflectance, PredictsNewPhotographsOfADiscOfTwoMaterials) {
  std::mt19937 random(1);
  const Disc disc = randomDisc(400, 50, random);
  const SharedReflectance shared =
      shareReflectance(disc.photographs.view(), {disc.places, disc.frames},
                       {.white = planted::kWhite, .grid = {{17, 17, 5, 5}}, .mostTables = 4});
  EXPECT_EQ(shared.tables.count(), 2u);
  double error = 0, all = 0;
  for (size_t s = 0; s < disc.places.size(); ++s) {
    const double fibre = shared.fibres[s].radians() - disc.fibres[s]; // of the tables, against the true one
    const Eigen::AngleAxisf turn(static_cast<float>(-fibre), Vec3<float>::UnitZ());
    for (int i = 0; i < 5; ++i) {
      const auto view = planted::above(random, 0.2), light = planted::above(random, 0.2);
      const std::vector v{assume<Direction3<SurfelSpace>>(turn * view.raw())};
      const std::vector l{assume<Direction3<SurfelSpace>>(turn * light.raw())};
      std::vector<Rgb> got(1);
      predictReflectance(shared.tables, shared.mixtures[s], v, l, got);
      const Rgb wanted = disc.gains[s] * planted::reflectanceOf(disc.materialOf(s), view, light);
      error += std::pow(shared.gains[s].g * got[0].g - wanted.g, 2);
      all += std::pow(wanted.g, 2);
    }
  }
  EXPECT_LT(error / all, 0.05);
}

TEST(SharedReflectance, IsTheSameForAnyNumberOfThreads) {
  std::mt19937 random(2);
  const Disc disc = randomDisc(80, 16, random);
  const auto run = [&] {
    return shareReflectance(disc.photographs.view(), {disc.places, disc.frames},
                            {.white = planted::kWhite, .grid = {{9, 9, 3, 3}}, .mostTables = 3});
  };
  const SharedReflectance many = run();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const SharedReflectance again = run();
  EXPECT_EQ(again.tables.values, many.tables.values);
  EXPECT_EQ(again.gains, many.gains);
}

// A surfel without photographs has the mean gain of the eight nearest; one with kEnough has its own.
TEST(SharedReflectance, SurfelsWithFewPhotographsFollowTheirNeighbours) {
  std::mt19937 random(4);
  const Disc disc = randomDisc(100, 20, random);
  const SurfelPlaces surfels{disc.places, disc.frames};
  const SharedReflectance sample = shareReflectance(
      disc.photographs.view(), surfels, {.white = planted::kWhite, .grid = {{9, 9, 3, 3}}, .mostTables = 1});
  const auto gainsWith = [&](size_t ofFirst) { // of all surfels, with so many photographs of the first one
    PhotographArrays fewer;
    for (uint32_t s = 0; s < disc.places.size(); ++s) {
      const uint32_t begin = disc.photographs.first[s];
      const size_t count = s == 0 ? ofFirst : disc.photographs.first[s + 1] - begin;
      for (size_t i = begin; i < begin + count; ++i)
        fewer.add(disc.photographs.towardsView[i], disc.photographs.towardsLight[i],
                  disc.photographs.reflectance[i]);
      fewer.endSurfel();
    }
    return spreadReflectance(sample, surfels, surfels, [&](size_t, size_t) { return fewer; }).gains;
  };
  const std::vector<Rgb> whole = gainsWith(20), none = gainsWith(0);
  std::vector<uint32_t> others(disc.places.size() - 1);
  std::iota(others.begin(), others.end(), 1u);
  std::ranges::sort(others, {},
                    [&](uint32_t s) { return (disc.places[s].raw() - disc.places[0].raw()).norm(); });
  Rgb mean;
  for (size_t i = 0; i < 8; ++i) mean = mean + 1.f / 8 * whole[others[i]];
  EXPECT_NEAR(none[0].g, mean.g, 1e-5);
  EXPECT_GT(std::abs(whole[0].g - mean.g), 0.01);
  EXPECT_TRUE(std::equal(whole.begin() + 1, whole.end(), none.begin() + 1));
}

TEST(SharedReflectance, OfSurfelsWithoutPhotographsIsBlack) {
  std::mt19937 random(3);
  const Disc disc = randomDisc(5, 0, random);
  const SharedReflectance shared =
      shareReflectance(disc.photographs.view(), {disc.places, disc.frames}, {.grid = {{5, 5, 3, 3}}});
  EXPECT_EQ(shared.tables.count(), 1u);
  EXPECT_EQ(shared.gains, std::vector<Rgb>(5, Rgb{1, 1, 1}));
  const std::vector v(1, Direction3<SurfelSpace>(0, 0, 1));
  for (const TableMixture& mixture : shared.mixtures) {
    std::vector<Rgb> got(1);
    predictReflectance(shared.tables, mixture, v, v, got);
    EXPECT_EQ(got[0], Rgb{});
  }
}

} // namespace
} // namespace surflect::reflectance
