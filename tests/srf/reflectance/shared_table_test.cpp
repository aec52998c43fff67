#include "srf/reflectance/shared_table.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>

#include <numeric>

namespace surflect::reflectance {
namespace {

const TableGrid kCoarseGrid{{17, 17, 7, 7}};

struct Fitted {
  PhotographArrays captured;
  std::vector<Rgb> planted;
  SharedTable table;
};

// `outliers`: part of the photographs that show a flare instead.
Fitted fitted(const planted::Material& material, size_t surfels, size_t photographs, double outliers,
              unsigned seed) {
  std::mt19937 random(seed);
  Fitted all;
  for (size_t s = 0; s < surfels; ++s) {
    all.planted.push_back(planted::randomGain(random));
    planted::addSurfel(all.captured, material, all.planted.back(), photographs, random);
  }
  for (Rgb& y : all.captured.reflectance)
    if (std::uniform_real_distribution<>()(random) < outliers) y = {2, 2, 2};
  const Photographs given = all.captured.view();
  all.table = fitSharedTable(kCoarseGrid, given, placesOf(kCoarseGrid, given.directions),
                             std::vector<float>(surfels, 1.f), {.white = planted::kWhite});
  return all;
}

// Mean squared error of the table over that of black, for new photographs of the same surfels.
double relativeError(const Fitted& fit, const planted::Material& material, unsigned seed) {
  std::mt19937 random(seed);
  double error = 0, all = 0;
  for (size_t s = 0; s < fit.planted.size(); ++s)
    for (int i = 0; i < 10; ++i) {
      const auto view = planted::above(random, 0.2), light = planted::above(random, 0.2);
      const Rgb wanted = fit.planted[s] * planted::reflectanceOf(material, view, light);
      const Rgb got =
          tableLink(light.z(), view.z()) * fit.table.gains[s] *
          lookUpNodes(kCoarseGrid, fit.table.nodes, placeOf(kCoarseGrid, halfDifference(view, light)));
      error += (got.r - wanted.r) * (got.r - wanted.r) + (got.b - wanted.b) * (got.b - wanted.b);
      all += wanted.r * wanted.r + wanted.b * wanted.b;
    }
  return error / all;
}

TEST(SharedTable, PredictsNewPhotographsOfSurfelsWithGains) {
  EXPECT_LT(relativeError(fitted(planted::kMatte, 300, 40, 0, 1), planted::kMatte, 2), 0.003);
  EXPECT_LT(relativeError(fitted(planted::kGlossy, 300, 40, 0, 3), planted::kGlossy, 4), 0.0042);
  EXPECT_LT(relativeError(fitted(planted::kBrushed, 300, 40, 0, 5), planted::kBrushed, 6), 0.0275);
}

TEST(SharedTable, RecoversGainsUpToOneCommonFactor) {
  const Fitted fit = fitted(planted::kBrushed, 200, 60, 0, 7);
  std::vector<double> logarithms;
  for (size_t s = 0; s < fit.planted.size(); ++s)
    logarithms.push_back(std::log(fit.table.gains[s].g / fit.planted[s].g));
  const auto count = static_cast<double>(logarithms.size());
  const double mean = std::accumulate(logarithms.begin(), logarithms.end(), 0.0) / count;
  double variance = 0;
  for (const double x : logarithms) variance += (x - mean) * (x - mean) / count;
  EXPECT_LT(std::sqrt(variance), 0.07); // those planted: 0.4
}

TEST(SharedTable, FlaresHardlyCount) {
  const double clean = relativeError(fitted(planted::kMatte, 200, 40, 0, 8), planted::kMatte, 9);
  const double spoiled = relativeError(fitted(planted::kMatte, 200, 40, 0.03, 8), planted::kMatte, 9);
  EXPECT_LT(clean, 0.0035);
  EXPECT_LT(spoiled, 1.5 * clean); // 3 % of flares of six times the brightness
}

TEST(SharedTable, SurfelsWithoutMembershipDoNotCount) {
  std::mt19937 random(10);
  PhotographArrays both, one;
  for (int s = 0; s < 20; ++s) planted::addSurfel(both, planted::kMatte, {1, 1, 1}, 30, random);
  one = both;
  for (int s = 0; s < 20; ++s) planted::addSurfel(both, planted::kBrushed, {1, 1, 1}, 30, random);
  std::vector<float> membership(40, 0.f);
  std::fill_n(membership.begin(), 20, 1.f);
  const auto fit = [](const PhotographArrays& captured, const std::vector<float>& members) {
    const Photographs given = captured.view();
    return fitSharedTable(kCoarseGrid, given, placesOf(kCoarseGrid, given.directions), members,
                          {.white = planted::kWhite});
  };
  EXPECT_EQ(fit(both, membership).nodes, fit(one, std::vector<float>(20, 1.f)).nodes);
}

} // namespace
} // namespace surflect::reflectance
