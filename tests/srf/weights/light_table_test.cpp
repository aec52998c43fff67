#include "srf/weights/light_table.h"

#include "tests/srf/weights/lights.h"
#include "tests/support/each_simd.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::weights {
namespace {

using lights::Direction;
using lights::inDouble;
using lights::randomDirection;
using lights::spiral;
using lights::sumOf;
using lights::weightsOf;
using ToAcquisition = Rotation<AcquisitionSpace, EnvironmentSpace, float>;

LightTable tableOf(std::span<const Direction> lights, const LightBlend& how,
                   LightExtrapolation extrapolation) {
  return LightTable(inDouble(lights), how, extrapolation);
}

// Tabulated weight of each light for a source of irradiance 1 in direction d.
std::vector<float> tabulated(const LightTable& table, size_t lights, const Direction& d) {
  std::vector<Eigen::Array4f> row(lights, Eigen::Array4f::Zero());
  const EnvironmentLight light{assume<Direction3<EnvironmentSpace>>(d.raw()), {1, 2, 3}};
  table.spread({{&light, 1}}, ToAcquisition(), row);
  std::vector<float> weights;
  for (const auto& sum : row) {
    EXPECT_EQ(sum[1], 2 * sum[0]);
    EXPECT_NEAR(sum[2], 3 * sum[0], 5e-7);
    weights.push_back(sum[0]);
  }
  return weights;
}

constexpr LightBlend meanOfThree{3, LightFit::mean}, planeOfFour{4, LightFit::plane};

TEST(LightTable, WeightsOfAMeanAndThoseToBeForeshortenedSumToOne) {
  std::mt19937 random(1);
  for (const int count : {1, 2, 6, 30, 100})
    for (const LightBlend& how :
         {LightBlend{1}, LightBlend{3}, LightBlend{8}, LightBlend{4, LightFit::plane, true}}) {
      const LightTable table = tableOf(spiral(count), how, LightExtrapolation::clamp);
      for (int i = 0; i < 300; ++i) {
        const auto weights = tabulated(table, count, randomDirection(random));
        EXPECT_NEAR(sumOf(weights), 1, 1e-6);
        if (how.fit == LightFit::mean) {
          EXPECT_GE(*std::ranges::min_element(weights), 0);
        }
      }
    }
}

double totalError(std::span<const float> got, std::span<const float> wanted) {
  double error = 0;
  for (size_t l = 0; l < got.size(); ++l) error += std::abs(got[l] - wanted[l]);
  return error;
}

// Tables are compared by their mean error over directions, and for a source as wide as a quarter of the
// lights' spacing. At single directions the error can be large: ULR weights are steep where the last blended
// lights are about as far as the threshold.
class LightTableOf : public ::testing::TestWithParam<LightBlend> {};

TEST_P(LightTableOf, EqualsTheBlend) {
  const LightBlend how = GetParam();
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  for (const int count : {12, 30, 100})
    for (const double lowest : {-1.0, 0.2}) {
      const auto lights = spiral(count, lowest);
      const LightExtrapolationFade coverage = surflect::weights::lights::coverageOf(lights);
      for (const auto extrapolation : {LightExtrapolation::clamp, LightExtrapolation::fade}) {
        const LightTable table = tableOf(lights, how, extrapolation);
        double mean = 0, worst = 0;
        constexpr int sources = 40, rays = 150;
        for (int source = 0; source < sources; ++source) {
          const Vec3<float> middle = randomDirection(random).raw();
          std::vector<float> gotSum(lights.size()), wantedSum(lights.size());
          for (int ray = 0; ray < rays; ++ray) {
            const float x = normal(random), y = normal(random), z = normal(random);
            const auto d = assume<Direction3<AcquisitionSpace>>(
                (middle + static_cast<float>(coverage.spacing()) / 4 * Vec3<float>(x, y, z)).normalized());
            const auto got = tabulated(table, lights.size(), d);
            const auto wanted = weightsOf(lights, d, how, coverage, extrapolation);
            mean += totalError(got, wanted) / (sources * rays);
            for (size_t l = 0; l < lights.size(); ++l) {
              gotSum[l] += got[l] / rays;
              wantedSum[l] += wanted[l] / rays;
            }
          }
          worst = std::max(worst, totalError(gotSum, wantedSum));
        }
        EXPECT_LT(mean, 0.005) << count << ' ' << lowest;
        EXPECT_LT(worst, 0.0075) << count << ' ' << lowest;
      }
    }
}

INSTANTIATE_TEST_SUITE_P(, LightTableOf, ::testing::Values(meanOfThree, planeOfFour));

TEST(LightTable, ASmallTurnChangesLittleEverywhere) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  const auto lights = spiral(30);
  const LightTable table = tableOf(lights, meanOfThree, LightExtrapolation::clamp);
  // No weight falls by more than a half over the width of a cell, 2 / 262 on the square (measured: 40 per
  // radian); a jump would be a hundred times steeper.
  constexpr float steepest = 0.5f / (2 / 262.f);
  for (int i = 0; i < 5000; ++i) {
    auto d = randomDirection(random).raw();
    if (i % 2) d[i % 3] = 0; // includes the seams of the unfolded octahedron
    d.normalize();
    const float x = normal(random), y = normal(random), z = normal(random);
    const Vec3<float> moved = (d + 1e-5f * Vec3<float>(x, y, z)).normalized();
    for (const Simd simd : EachSimd()) {
      const auto a = tabulated(table, lights.size(), assume<Direction3<AcquisitionSpace>>(d));
      const auto b = tabulated(table, lights.size(), assume<Direction3<AcquisitionSpace>>(moved));
      for (size_t l = 0; l < lights.size(); ++l)
        EXPECT_NEAR(a[l], b[l], steepest * (moved - d).norm()) << nameOf(simd);
    }
  }
}

// Octahedral unfolding to the square [-1, 1]^2, in double precision  [Praun, Hoppe 2003].
std::array<double, 2> unfolded(const Vec3<double>& d) {
  const double sum = std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]), a = d[0] / sum, b = d[1] / sum;
  if (d[2] >= 0) return {a, b};
  return {std::copysign(1 - std::abs(b), a), std::copysign(1 - std::abs(a), b)};
}

TEST(LightTable, DirectionsAreUnfoldedOntoTheSquare) {
  std::mt19937 random(7);
  constexpr size_t groups = 40, cells = 371;
  std::vector<float> directions, cell(groups * kQueryLanes), right(cell.size()), down(cell.size());
  std::vector<Vec3<double>> all;
  for (const double x : {-1., -0., 0., 1.}) // corners, edges and centre, with zeros of both signs
    for (const double y : {-1., -0., 0., 1.})
      for (const double z : {-1., -0., 0., 1.})
        if (x != 0 || y != 0 || z != 0) all.push_back(Vec3<double>(x, y, z).normalized());
  while (all.size() < cell.size()) all.push_back(randomDirection(random).raw().cast<double>());
  for (size_t g = 0; g < groups; ++g)
    for (int axis = 0; axis < 3; ++axis)
      for (size_t lane = 0; lane < kQueryLanes; ++lane)
        directions.push_back(static_cast<float>(all[g * kQueryLanes + lane][axis]));
  const Mat3<double> random3 = Eigen::Quaterniond(0.2, -0.4, 0.8, 0.3).normalized().toRotationMatrix();
  for (const Mat3<double>& turn : {Mat3<double>(Mat3<double>::Identity()), random3})
    for (const Simd simd : EachSimd()) {
      const Mat3<float> single = turn.cast<float>();
      findCells(directions.data(), groups, single.data(), cells, cell.data(), right.data(), down.data());
      for (size_t i = 0; i < all.size(); ++i) {
        ASSERT_TRUE(cell[i] >= 0 && cell[i] < cells * cells && cell[i] == std::floor(cell[i]));
        EXPECT_TRUE(right[i] >= 0 && right[i] <= 1 && down[i] >= 0 && down[i] <= 1)
            << right[i] << ' ' << down[i];
        const auto place = [&](double inCells) { return 2 * inCells / cells - 1; };
        const double a = place(std::fmod(cell[i], cells) + right[i]),
                     b = place(std::floor(cell[i] / cells) + down[i]);
        const auto [wantedA, wantedB] = unfolded(turn * all[i]);
        // On the cut edges of the octahedron, a direction has two places.
        const bool isCut = std::max(std::abs(wantedA), std::abs(wantedB)) > 1 - 1e-6;
        EXPECT_NEAR(isCut ? std::abs(a) : a, isCut ? std::abs(wantedA) : wantedA, 1e-6) << nameOf(simd) << i;
        EXPECT_NEAR(isCut ? std::abs(b) : b, isCut ? std::abs(wantedB) : wantedB, 1e-6) << nameOf(simd) << i;
      }
    }
}

TEST(LightTable, ForeshortensWhatItHasTabulated) {
  std::mt19937 random(5);
  const auto lights = spiral(30);
  const LightTable table = tableOf(lights, meanOfThree, LightExtrapolation::fade);
  for (int i = 0; i < 500; ++i) {
    const auto normal = assume<Normal3<AcquisitionSpace>>(randomDirection(random).raw());
    std::vector<float> cosines;
    for (const auto& light : lights) cosines.push_back(foreshortenedCosine(normal, light));
    const auto d = randomDirection(random);
    const auto plain = tabulated(table, lights.size(), d);
    BlendSet blend;
    for (uint32_t l = 0; l < lights.size(); ++l)
      if (plain[l] != 0) blend.push({l, plain[l]});
    const float factor = foreshortening(foreshortenedCosine(normal, d), blendedCosine(blend, cosines));
    std::vector<Eigen::Array4f> row(lights.size(), Eigen::Array4f::Zero());
    const EnvironmentLight light{assume<Direction3<EnvironmentSpace>>(d.raw()), {1, 1, 1}};
    const Foreshortened surface{normal, cosines};
    table.spread({{&light, 1}}, ToAcquisition(), row, &surface);
    for (size_t l = 0; l < lights.size(); ++l) {
      EXPECT_NEAR(row[l][0], factor * plain[l], 1e-6f);
      EXPECT_NEAR(row[l][3], 3 * plain[l], 1e-6f); // sum of three channels, before foreshortening
    }
  }
}

// The mean shadow state of the blended lights, weighted by their cosines.
TEST(LightTable, ThePartThatReachesASurfelIsThatOfTheBlendedLights) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(0, 1);
  const auto lights = spiral(20);
  const LightTable table = tableOf(lights, meanOfThree, LightExtrapolation::fade);
  for (int i = 0; i < 500; ++i) {
    const auto normal = assume<Normal3<AcquisitionSpace>>(randomDirection(random).raw());
    std::vector<float> cosines, states;
    for (const auto& light : lights) {
      cosines.push_back(foreshortenedCosine(normal, light));
      states.push_back(any(random));
    }
    const auto d = randomDirection(random);
    const auto weights = tabulated(table, lights.size(), d);
    double all = 0, facing = 1e-3, lit = 1e-3;
    for (size_t l = 0; l < lights.size(); ++l) {
      all += weights[l];
      facing += weights[l] * cosines[l];
      lit += weights[l] * cosines[l] * states[l];
    }
    std::vector<Eigen::Array4f> row(lights.size(), Eigen::Array4f::Zero());
    std::vector<float> parts(1);
    const EnvironmentLight light{assume<Direction3<EnvironmentSpace>>(d.raw()), {1, 1, 1}};
    const ReachedParts reached{cosines, states, parts};
    table.spread({{&light, 1}}, ToAcquisition(), row, nullptr, &reached);
    EXPECT_NEAR(parts[0], std::min(1.0, all) * lit / facing, 1e-5);
  }
}

TEST(LightTable, TheTurnTurnsAndAddsToTheRow) {
  std::mt19937 random(4);
  const auto lights = spiral(20);
  const LightTable table = tableOf(lights, meanOfThree, LightExtrapolation::clamp);
  const Mat3<float> turn = Eigen::Quaternionf(0.5f, 0.1f, -0.7f, 0.5f).normalized().toRotationMatrix();
  for (const Mat3<float>& matrix : {turn, Mat3<float>(-turn)}) {
    const auto d = randomDirection(random);
    std::vector<Eigen::Array4f> row(lights.size(), Eigen::Array4f::Constant(5));
    const EnvironmentLight light{assume<Direction3<EnvironmentSpace>>(matrix.transpose() * d.raw()),
                                 {1, 1, 1}};
    table.spread({{&light, 1}}, ToAcquisition(matrix), row);
    const auto direct = tabulated(table, lights.size(), d);
    for (size_t l = 0; l < lights.size(); ++l) EXPECT_NEAR(row[l][0], 5 + direct[l], 2e-5);
  }
}

// Two batches of four groups of lanes, and a few more lights.
TEST(LightTable, ManyLightsGiveWhatEachOfThemGives) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> strength(0.1f, 1);
  const auto lights = spiral(20);
  const LightTable table = tableOf(lights, meanOfThree, LightExtrapolation::clamp);
  std::vector<EnvironmentLight> environment;
  Rgb total;
  for (int i = 0; i < 150; ++i) {
    const float r = strength(random), g = strength(random), b = strength(random);
    environment.push_back({assume<Direction3<EnvironmentSpace>>(randomDirection(random).raw()), {r, g, b}});
    total = total + environment.back().irradiance;
  }
  const ToAcquisition turn(Eigen::Quaternionf(0.3f, -0.6f, 0.2f, 0.7f).normalized().toRotationMatrix());
  for (const Simd simd : EachSimd())
    for (const size_t count :
         {size_t{0}, size_t{1}, size_t{16}, size_t{64}, size_t{65}, environment.size()}) {
      std::vector<Eigen::Array4f> row(lights.size(), Eigen::Array4f::Zero()), wanted = row;
      table.spread({std::span(environment).first(count)}, turn, row);
      wanted = inSimd(Simd::scalar, [&] {
        std::vector<Eigen::Array4f> sums = wanted;
        for (size_t i = 0; i < count; ++i) table.spread({std::span(environment).subspan(i, 1)}, turn, sums);
        return sums;
      });
      Eigen::Array4f sum = Eigen::Array4f::Zero();
      for (size_t l = 0; l < lights.size(); ++l) {
        EXPECT_LT((row[l] - wanted[l]).abs().maxCoeff(), 6e-6f) << nameOf(simd) << ' ' << count << ' ' << l;
        sum += row[l];
      }
      if (count < environment.size()) continue;
      EXPECT_NEAR(sum[0], total.r, 1e-4);
      EXPECT_NEAR(sum[1], total.g, 1e-4);
      EXPECT_NEAR(sum[2], total.b, 1e-4);
    }
}

} // namespace
} // namespace surflect::weights
