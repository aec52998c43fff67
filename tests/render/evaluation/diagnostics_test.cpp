#include "render/evaluation/diagnostics.h"

#include "tests/srf/image/files.h"
#include "tests/warp/meshes.h"
#include "tests/warp/point_caches.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace surflect::evaluation {

namespace {

// Three pixels of the object, one at its outline, and a black one; predicted errors rise from 0.
TEST(Trust, CountsPixelsOfTheObjectWhosePredictedErrorIsSmall) {
  image::Image color(5, 1, 4), error(5, 1, 1);
  color.values[4 * 4 + 3] = 0.75f; // without an error
  for (size_t pixel = 0; pixel < 4; ++pixel) {
    color.values[4 * pixel] = 0.5f;
    color.values[4 * pixel + 3] = pixel == 3 ? 0.25f : 1;
    error.values[pixel] = 0.02f * static_cast<float>(pixel);
  }
  const Trust trust = trustIn(color, error, 1);
  EXPECT_EQ(trust.pixels, 4u);
  EXPECT_EQ(trust.trusted, 3u); // 0 and 0.02 are below 10/255, 0.04 is not
  EXPECT_EQ(trustIn(color, error, 2).trusted, 4u);
  EXPECT_EQ(trustIn(color, error, 0).trusted, 2u);
}

TEST(Trust, AddsUpOverPictures) {
  Trust film{10, 4};
  film += {30, 26};
  EXPECT_DOUBLE_EQ(film.share(), 0.75);
  EXPECT_DOUBLE_EQ(Trust().share(), 1);
}

} // namespace

namespace {

class Unreached : public ::testing::Test {
protected:
  Unreached() {
    warp::writeObj(folder / "cage.obj", warp::torus(24, 12));
    warp::writeObj(folder / "cage.1.obj", warp::torus(24, 12));
    for (const auto& p : warp::torus(96, 48).positions) object.push_back(p);
  }
  std::optional<std::string> of(const std::string& before, const std::string& after = "") const {
    const scene::Script script = scene::parseScript(
        before + "[[warp]]\ntype = \"mesh\"\nrest = \"cage.obj\"\nframes = \"cage.#.obj\"\n" + after,
        folder / "film.toml");
    return misplacedRestMesh(script, scene::shotTime(script, 1), object);
  }
  static std::string scale(const std::string& factor) {
    return "[[warp]]\ntype = \"scale\"\nfactor = [" + factor + ", " + factor + ", " + factor + "]\n";
  }

  image::TemporaryFolder folder;
  std::vector<Point3<AcquisitionSpace>> object;
};

TEST_F(Unreached, AMeshAroundTheSurfelsIsRight) {
  EXPECT_EQ(of(""), std::nullopt);
  EXPECT_EQ(of("", scale("100")), std::nullopt); // what comes after it does not matter
  EXPECT_EQ(of(scale("100") + scale("0.01")), std::nullopt);
}

// Caches in an object's own coordinates are the rest mesh turned, scaled and moved back.
TEST_F(Unreached, ACacheThatBeginsWithTheMeshInAnotherPlaceIsTold) {
  const auto told = [&](double degrees, double scale, const Vec3<double>& shift, double bend) {
    const Mat3<double> turn =
        Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3<double>(1, 2, 3).normalized())
            .toRotationMatrix();
    std::vector<Vec3<double>> first;
    for (const auto& p : warp::torus(24, 12).positions) {
      const Vec3<double> x = p.raw().cast<double>();
      first.emplace_back(scale * (turn * x) + shift + Vec3<double>(0, bend * x[0] * x[0], 0));
    }
    image::writeBytes(folder / "a.pc2", warp::pc2Bytes(0, 1, {first}));
    const scene::Script script = scene::parseScript(
        "[[warp]]\ntype = \"mesh\"\nrest = \"cage.obj\"\ncache = \"a.pc2\"\n", folder / "film.toml");
    return misplacedRestMesh(script, scene::shotTime(script, 1), object).value_or("nothing");
  };
  EXPECT_EQ(told(0, 1, {0, 0, 0}, 0), "nothing");
  EXPECT_EQ(told(0, 1, {0, 0, 0}, 0.1), "nothing"); // a pose
  EXPECT_EQ(told(30, 0.5, {1, 0, 0}, 0.1), "nothing");
  const std::string line = told(30, 0.5, {1, 0, 0}, 0);
  EXPECT_NE(
      line.find("film.toml: warp[0]: its cache begins with the rest mesh turned by 30.0 degrees, scaled "
                "by 0.5, moved by 1"),
      std::string::npos)
      << line;
  EXPECT_NE(told(0, 1, {0, 2, 0}, 0).find("rest mesh moved by 2:"), std::string::npos);
}

TEST_F(Unreached, OneInOtherUnitsIsTold) {
  const auto line = of(scale("100"));
  ASSERT_TRUE(line);
  EXPECT_NE(line->find("film.toml: warp[1]: 100 % of the surfels"), std::string::npos) << *line;
  EXPECT_EQ(line->find('\n'), std::string::npos);
  EXPECT_TRUE(of(scale("0.01"))); // all in the hole of the torus
}

// A torus that stands beside the origin, and the same one after rigid warps about x.
TEST_F(Unreached, OneWithAnotherAxisUpIsToldWithTheTurnThatMendsIt) {
  TriangleMesh standing = warp::torus(24, 12);
  for (auto& p : standing.positions) p = p + Direction3<AcquisitionSpace>(0, 0, 2);
  object = standing.positions;
  for (auto& p : standing.positions) { // z up becomes y up
    const Vec3<float> x = p.raw();
    p = assume<Point3<AcquisitionSpace>>(Vec3<float>(x[0], x[2], -x[1]));
  }
  warp::writeObj(folder / "cage.obj", standing);
  warp::writeObj(folder / "cage.1.obj", standing);
  const auto line = of("");
  ASSERT_TRUE(line);
  EXPECT_NE(line->find("turned by 90 degrees about x, from y up to z up"), std::string::npos) << *line;
  EXPECT_NE(line->find("angle_deg = -90 before it"), std::string::npos) << *line;
  const std::string rigid = "[[warp]]\ntype = \"rigid\"\naxis = [1, 0, 0]\nangle_deg = ";
  EXPECT_EQ(of(rigid + "-90\n", rigid + "90\n"), std::nullopt);
}

// A torus around the origin lies as well when it is turned the other way.
TEST_F(Unreached, OneThatMayBeTurnedEitherWayIsToldSo) {
  for (auto& p : object) {
    const Vec3<float> x = p.raw();
    p = assume<Point3<AcquisitionSpace>>(Vec3<float>(x[0], x[2], -x[1]));
  }
  const auto line = of("");
  ASSERT_TRUE(line);
  EXPECT_NE(line->find("turned by 90 or -90 degrees about x"), std::string::npos) << *line;
}

} // namespace

namespace {

std::vector<double> randomValues(size_t count, uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> values(count);
  for (double& value : values) value = uniform(rng);
  return values;
}

std::vector<double> mapped(std::vector<double> values, double (*function)(double)) {
  std::ranges::transform(values, values.begin(), function);
  return values;
}

TEST(RankCorrelation, EqualValuesShareTheMeanOfTheirRanks) {
  EXPECT_EQ(ranksOf(std::vector<double>{5, 1, 5, 5, 0}), (std::vector<double>{3, 1, 3, 3, 0}));
}

TEST(RankCorrelation, IsOneForAnyRisingFunctionAndMinusOneForAnyFallingOne) {
  const std::vector<double> a = randomValues(500, 1);
  const auto rising = [](double x) { return std::exp(3 * x); };
  const auto falling = [](double x) { return -x * x * x; };
  EXPECT_NEAR(rankCorrelation(a, mapped(a, rising)).value(), 1, 1e-12);
  EXPECT_NEAR(rankCorrelation(a, mapped(a, falling)).value(), -1, 1e-12);
}

TEST(RankCorrelation, OfIndependentValuesIsNearZero) {
  EXPECT_LT(std::abs(rankCorrelation(randomValues(4000, 1), randomValues(4000, 2)).value()), 0.05);
}

// Without ties it is 1 - 6 sum d^2 / (n (n^2 - 1)), where d is the difference of ranks.
TEST(RankCorrelation, IsTheClosedFormWithoutTies) {
  const std::vector<double> a = randomValues(40, 3), b = randomValues(40, 4);
  const std::vector<double> ranksA = ranksOf(a), ranksB = ranksOf(b);
  double squares = 0;
  for (size_t i = 0; i < a.size(); ++i) squares += (ranksA[i] - ranksB[i]) * (ranksA[i] - ranksB[i]);
  EXPECT_NEAR(rankCorrelation(a, b).value(), 1 - 6 * squares / (40 * (40 * 40 - 1)), 1e-12);
}

TEST(RankCorrelation, DoesNotDependOnTheOrderInWhichTiesAreListed) {
  const std::vector<double> a{1, 1, 2, 2, 3, 3}, b{1, 2, 3, 4, 5, 6}, swapped{2, 1, 4, 3, 6, 5};
  EXPECT_DOUBLE_EQ(rankCorrelation(a, b).value(), rankCorrelation(a, swapped).value());
  EXPECT_LT(rankCorrelation(a, b).value(), 1);
}

TEST(RankCorrelation, IsNothingForAConstant) {
  EXPECT_FALSE(rankCorrelation(std::vector<double>{1, 2, 3}, std::vector<double>{4, 4, 4}));
  EXPECT_FALSE(rankCorrelation(std::vector<double>{1}, std::vector<double>{2}));
  EXPECT_FALSE(rankCorrelation({}, {}));
}

} // namespace

namespace {

const std::vector<double> errorOfPart{3, 1, 4, 1, 5, 9, 2, 6, 5, 3};

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

TEST(Sparsification, BeginsWithTheErrorOfAllParts) {
  double sum = 0;
  for (const double e : errorOfPart) sum += e * e;
  const Sparsification curves = sparsify(errorOfPart, scaled(errorOfPart, -1), 5);
  EXPECT_DOUBLE_EQ(curves.best[0], std::sqrt(sum / 10));
  EXPECT_DOUBLE_EQ(curves.byPrediction[0], curves.best[0]);
}

// Half of the parts taken away leaves the errorOfPart 1, 1, 2, 3, 3.
TEST(Sparsification, ThatOfAPerfectOrderIsTheBestAndFalls) {
  const Sparsification curves = sparsify(errorOfPart, scaled(errorOfPart, 0.1), 10);
  for (size_t step = 0; step < 10; ++step)
    EXPECT_DOUBLE_EQ(curves.byPrediction[step], curves.best[step]) << step;
  for (size_t step = 1; step < 10; ++step) EXPECT_LE(curves.best[step], curves.best[step - 1]) << step;
  EXPECT_DOUBLE_EQ(curves.best[5], std::sqrt(24 / 5.0));
  EXPECT_DOUBLE_EQ(sparsificationError(curves), 0);
}

TEST(Sparsification, AReversedOrderRisesAboveEveryOther) {
  const Sparsification reversed = sparsify(errorOfPart, scaled(errorOfPart, -1), 10),
                       other = sparsify(errorOfPart, std::vector<double>{2, 7, 1, 8, 2, 8, 1, 8, 2, 8}, 10);
  EXPECT_DOUBLE_EQ(reversed.byPrediction[9], 9);
  EXPECT_GT(sparsificationError(reversed), sparsificationError(other));
  EXPECT_GT(sparsificationError(other), 0);
}

TEST(Sparsification, AConstantPredictionLeavesAFlatCurve) {
  for (const double left : sparsify(errorOfPart, std::vector<double>(10, 0.5), 10).byPrediction)
    EXPECT_NEAR(left, std::sqrt(207 / 10.0), 1e-12);
}

TEST(Sparsification, NothingIsLeftOfNothing) {
  EXPECT_TRUE(sparsify({}, {}, 10).best.empty());
  EXPECT_EQ(sparsificationError(sparsify({}, {}, 10)), 0);
  EXPECT_EQ(sparsificationError(sparsify(std::vector<double>{0, 0}, std::vector<double>{1, 2}, 2)), 0);
}

} // namespace

} // namespace surflect::evaluation
