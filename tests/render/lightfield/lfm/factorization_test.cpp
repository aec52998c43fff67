#include "render/lightfield/lfm/factorization.h"

#include "render/lightfield/lfm/reference.h"
#include "surfel/base/error.h"
#include "tests/render/lightfield/lfm/glossy_matrix.h"

#include <Eigen/Core>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

namespace surflect::lfm {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

GlossyMatrix small() { return glossyMatrix(120, 8); }

// The part of each sample and cell that is unobserved is a wedge that turns with the cell.
GlossyMatrix withHoles(double share) {
  GlossyMatrix matrix = glossyMatrix(160, 9);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> phases(matrix.cells);
  for (double& phase : phases) phase = uniform(random);
  for (size_t sample = 0; sample < matrix.samples; ++sample)
    for (size_t cell = 0; cell < matrix.cells; ++cell)
      matrix.weights.push_back(
          std::fmod(phases[cell] + static_cast<double>(sample) * std::numbers::phi, 1.0) < share ? 0.0f
                                                                                                 : 1.0f);
  return matrix;
}

LightFieldMatrix holesOf(const GlossyMatrix& matrix, std::vector<float>& weights) {
  for (const float weight : matrix.weights) weights.push_back(1 - weight);
  return {matrix.samples, matrix.cells, matrix.radiance, weights};
}

double rms(const GlossyMatrix& matrix, const FactorizationOptions& options) {
  return errorOf(factorized(matrix.view(), options), options.terms, matrix.view()).rms();
}

VectorXd vectorOf(const std::vector<float>& map) {
  return Eigen::Map<const Eigen::VectorXf>(map.data(), static_cast<Eigen::Index>(map.size())).cast<double>();
}

// M x 3N, without its mean: the matrix of scalar surface maps.
MatrixXd centred(const GlossyMatrix& matrix) {
  MatrixXd f(matrix.samples, 3 * matrix.cells);
  for (size_t i = 0; i < matrix.radiance.size(); ++i)
    f(i / (3 * matrix.cells), i % (3 * matrix.cells)) = double{matrix.radiance[i]};
  for (Eigen::Index row = 0; row < f.rows(); ++row)
    for (Eigen::Index c = 0; c < 3; ++c) {
      double mean = 0;
      for (Eigen::Index n = c; n < f.cols(); n += 3) mean += f(row, n);
      mean /= static_cast<double>(matrix.cells);
      for (Eigen::Index n = c; n < f.cols(); n += 3) f(row, n) -= mean;
    }
  return f;
}

// A fourth channel that is the mean of the others.
GlossyMatrix withOpacity(const GlossyMatrix& matrix) {
  GlossyMatrix four{matrix.samples, matrix.cells, {}, matrix.weights};
  for (size_t i = 0; i < matrix.radiance.size(); i += 3) {
    const auto rgb = std::span(matrix.radiance).subspan(i, 3);
    four.radiance.insert(four.radiance.end(), rgb.begin(), rgb.end());
    four.radiance.push_back((rgb[0] + rgb[1] + rgb[2]) / 3);
  }
  return four;
}

// Whole columns are unobserved, or single entries, or none.
TEST(Factorization, AFourthChannelThatTheOthersGiveIsFittedAsTheyAre) {
  for (const double holes : {0.0, 0.2})
    for (const bool isColumns : {false, true}) {
      GlossyMatrix four = withOpacity(withHoles(holes));
      if (isColumns)
        for (size_t i = 0; i < four.weights.size(); ++i) four.weights[i] = i % four.cells > 20;
      const LightFieldMatrix matrix{four.samples, four.cells, four.radiance, four.weights, 4};
      for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
        const Factors factors = factorized(matrix, {.method = method, .terms = 4});
        EXPECT_EQ(factors.channels, 4u);
        const std::vector<float> values = product(factors, 4);
        ASSERT_EQ(values.size(), four.radiance.size());
        EXPECT_LT(errorOf(factors, 4, matrix).rms(), method == Factorization::pca ? 0.02 : 0.04);
        double squares = 0, count = 0;
        for (size_t i = 0; i < values.size(); i += 4) {
          if (four.weights[i / 4] == 0) continue;
          const float mean = (values[i] + values[i + 1] + values[i + 2]) / 3;
          squares += std::pow(double{values[i + 3]} - double{mean}, 2), ++count;
        }
        EXPECT_LT(std::sqrt(squares / count), 0.02);
      }
    }
}

TEST(Pca, EqualsThePowerIterationOfTheAppendix) {
  const GlossyMatrix matrix = small();
  const ReferenceFactors reference = referencePca(centred(matrix), 4);
  const Factors factors = factorized(matrix.view(), {.terms = 4});
  ASSERT_EQ(factors.terms.size(), 4u);
  for (int k = 0; k < 4; ++k) {
    const VectorXd u = vectorOf(factors.terms[k].surface), v = vectorOf(factors.terms[k].view);
    const double sign = u.dot(reference.u.col(k)) < 0 ? -1 : 1, size = reference.u.col(k).norm();
    EXPECT_LT((sign * u - reference.u.col(k)).norm(), 1e-4 * size) << k;
    EXPECT_LT((sign * v - reference.v.col(k)).norm(), 1e-4 * reference.v.col(k).norm()) << k;
    EXPECT_NEAR(u.cwiseAbs().maxCoeff() / v.cwiseAbs().maxCoeff(), 1, 1e-6) << k;
  }
}

TEST(Pca, TermsAreOrthogonalAndTheStrongestComesFirst) {
  const Factors factors = factorized(small().view(), {.terms = 6});
  double before = std::numeric_limits<double>::infinity();
  for (const FactorTerm& a : factors.terms) {
    const VectorXd u = vectorOf(a.surface), v = vectorOf(a.view);
    EXPECT_LE(u.norm() * v.norm(), before);
    before = u.norm() * v.norm();
    for (const FactorTerm& b : factors.terms) {
      if (&a == &b) continue;
      EXPECT_LT(std::abs(u.dot(vectorOf(b.surface))), 1e-4 * u.norm() * vectorOf(b.surface).norm());
      EXPECT_LT(std::abs(v.dot(vectorOf(b.view))), 1e-4 * v.norm() * vectorOf(b.view).norm());
    }
  }
}

TEST(Pca, IsProgressive) {
  const GlossyMatrix matrix = small();
  const Factors many = factorized(matrix.view(), {.terms = 7});
  for (const size_t terms : {0u, 1u, 3u}) {
    const Factors few = factorized(matrix.view(), {.terms = terms});
    ASSERT_EQ(few.terms.size(), terms);
    EXPECT_EQ(few.mean, many.mean);
    for (size_t k = 0; k < terms; ++k) {
      EXPECT_LT((vectorOf(few.terms[k].surface) - vectorOf(many.terms[k].surface)).cwiseAbs().maxCoeff(),
                1e-4);
      EXPECT_LT((vectorOf(few.terms[k].view) - vectorOf(many.terms[k].view)).cwiseAbs().maxCoeff(), 1e-4);
    }
  }
}

TEST(Pca, EachTermLowersTheError) {
  const GlossyMatrix matrix = small();
  const Factors factors = factorized(matrix.view(), {.terms = 10});
  for (size_t k = 1; k <= 10; ++k)
    EXPECT_LT(errorOf(factors, k, matrix.view()).rms(), errorOf(factors, k - 1, matrix.view()).rms());
}

TEST(Pca, TakesTheFewestTermsWithinTheTolerance) {
  for (const GlossyMatrix& matrix : {small(), withHoles(0.3)})
    for (const double tolerance : {0.1, 0.02, 0.005}) {
      const Factors factors = factorized(matrix.view(), {.terms = 30, .tolerance = tolerance});
      const size_t terms = factors.terms.size();
      EXPECT_LE(errorOf(factors, terms, matrix.view()).rms(), 1.0001 * tolerance);
      if (terms > 0) {
        EXPECT_GT(errorOf(factors, terms - 1, matrix.view()).rms(), 0.9999 * tolerance);
      }
    }
}

TEST(Pca, AConstantMatrixIsItsMean) {
  const std::vector<float> radiance(3 * 50 * 40, 0.3f);
  const Factors factors = factorized({50, 40, radiance, {}}, {});
  EXPECT_TRUE(factors.terms.empty());
  for (const float mean : factors.mean) EXPECT_EQ(mean, 0.3f);
}

TEST(Pca, HasNoMoreTermsThanTheRank) {
  const GlossyMatrix matrix = small();
  Factors factors = factorized(matrix.view(), {.terms = 3});
  const std::vector<float> radiance = product(factors, 3);
  factors = factorized({matrix.samples, matrix.cells, radiance, {}}, {.terms = 10});
  EXPECT_EQ(factors.terms.size(), 3u);
}

TEST(Pca, ScalesWithTheRadianceAndFollowsTheOrderOfSamplesAndCells) {
  const GlossyMatrix matrix = small();
  const Factors factors = factorized(matrix.view(), {});
  GlossyMatrix turned = matrix;
  for (size_t sample = 0; sample < matrix.samples; ++sample)
    for (size_t i = 0; i < 3 * matrix.cells; ++i)
      turned.radiance[(matrix.samples - 1 - sample) * 3 * matrix.cells +
                      (3 * matrix.cells + i - 6) % (3 * matrix.cells)] =
          4 * matrix.radiance[sample * 3 * matrix.cells + i];
  const Factors others = factorized(turned.view(), {});
  for (size_t k = 0; k < 3; ++k) {
    const std::vector<float>&u = factors.terms[k].surface, &other = others.terms[k].surface;
    const float sign = u[0] * other[matrix.samples - 1] < 0 ? -1.0f : 1.0f;
    for (size_t i = 0; i < u.size(); ++i) EXPECT_NEAR(sign * other[u.size() - 1 - i], 2 * u[i], 2e-4);
  }
}

TEST(WeightedPca, FillsHolesFarBetterThanTheMean) {
  for (const double share : {0.1, 0.4}) {
    const GlossyMatrix matrix = withHoles(share);
    std::vector<float> weights;
    const LightFieldMatrix holes = holesOf(matrix, weights);
    const Factors factors = factorized(matrix.view(), {.terms = 4});
    EXPECT_LT(errorOf(factors, 4, holes).rms(), 0.4 * errorOf(factors, 0, holes).rms()) << share;
  }
}

TEST(WeightedPca, ReproducesWhatHasTheRankAskedFor) {
  GlossyMatrix matrix = withHoles(0.3);
  matrix.radiance = product(factorized({matrix.samples, matrix.cells, matrix.radiance, {}}, {.terms = 2}), 2);
  const Factors factors = factorized(matrix.view(), {.terms = 2, .mostIterations = 200, .convergence = 1e-6});
  std::vector<float> weights;
  EXPECT_LT(errorOf(factors, 2, holesOf(matrix, weights)).rms(), 1e-3);
}

TEST(WeightedPca, ItsErrorIsNotAboveThatOfPcaWithFilledHolesAndFallsWithTheTerms) {
  const GlossyMatrix matrix = withHoles(0.3);
  double before = std::numeric_limits<double>::infinity();
  for (const size_t terms : {1u, 2u, 4u, 8u}) {
    const double first = rms(matrix, {.terms = terms, .mostIterations = 0}),
                 fitted = rms(matrix, {.terms = terms});
    EXPECT_LT(fitted, first);
    EXPECT_LT(fitted, before);
    before = fitted;
  }
}

TEST(WeightedPca, WithEqualWeightsOfAnySizeIsPca) {
  GlossyMatrix matrix = small();
  const Factors plain = factorized(matrix.view(), {});
  matrix.weights.assign(matrix.samples * matrix.cells, 0.25f);
  EXPECT_EQ(product(factorized(matrix.view(), {}), 3), product(plain, 3));
  matrix.weights[17] = 0.2499f;
  const std::vector<float> nearly = product(factorized(matrix.view(), {}), 3), all = product(plain, 3);
  for (size_t i = 0; i < all.size(); ++i) EXPECT_NEAR(nearly[i], all[i], 2e-3);
}

TEST(WeightedPca, AMatrixThatIsConstantUpToRoundingIsItsMean) {
  std::vector<float> radiance(3 * 50 * 40, 0.3f), weights(50 * 40);
  for (size_t i = 0; i < radiance.size(); i += 7) radiance[i] = std::nextafter(0.3f, 1.0f);
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = static_cast<float>(1 + i % 7) / 7;
  const Factors factors = factorized({50, 40, radiance, weights}, {});
  EXPECT_TRUE(factors.terms.empty());
  for (const float mean : factors.mean) EXPECT_FLOAT_EQ(mean, 0.3f);
}

TEST(WeightedPca, WeightsThatVanishBesideOthersDoNotCount) {
  GlossyMatrix matrix = small();
  matrix.weights.assign(matrix.samples * matrix.cells, 1e10f);
  for (size_t i = 0; i < matrix.weights.size(); ++i)
    if (i / matrix.cells % 5 == 2 || i % 3 == 0) matrix.weights[i] = 1e-38f; // whole rows, and more
  const std::vector<float> faint = product(factorized(matrix.view(), {}), 3);
  for (float& weight : matrix.weights) weight = weight > 1 ? 1.0f : 0.0f;
  EXPECT_EQ(product(factorized(matrix.view(), {}), 3), faint);
  for (const float value : faint) EXPECT_TRUE(std::isfinite(value));
}

// Without noise the prior vanishes, and more terms than the rank are not determined.
TEST(WeightedPca, FirstTermsErrLittleMoreThanAShorterFit) {
  const GlossyMatrix matrix = withHoles(0.3);
  const auto fitted = [&](size_t terms) {
    return factorized(matrix.view(), {.terms = terms, .leastWeight = 0.02f});
  };
  const Factors many = fitted(6);
  for (const size_t terms : {0u, 1u, 2u, 4u}) {
    const double ratio =
        errorOf(many, terms, matrix.view()).rms() / errorOf(fitted(terms), terms, matrix.view()).rms();
    EXPECT_LT(ratio, 1.07) << terms; // 1.055 with two
  }
}

// Weights of rows times weights of cells: most of the object is seen from few directions.
TEST(WeightedPca, FirstTermsAreThoseOfAShorterFitIfWeightsAreProducts) {
  GlossyMatrix matrix = small();
  for (size_t i = 0; i < matrix.samples; ++i)
    for (size_t n = 0; n < matrix.cells; ++n)
      matrix.weights.push_back((i % 4 == 0 ? 1.f : 0.2f) * (n % 3 == 0 ? 1.f : 0.02f));
  const auto fitted = [&](size_t terms) { return factorized(matrix.view(), {.terms = terms}); };
  const Factors many = fitted(6);
  for (const size_t terms : {0u, 1u, 2u, 4u, 6u})
    EXPECT_LT(errorOf(many, terms, matrix.view()).rms(),
              1.01 * errorOf(fitted(terms), terms, matrix.view()).rms())
        << terms;
}

TEST(WeightedPca, FewExactObservationsAreSeldomExtrapolatedFar) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform;
  size_t far = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const size_t samples = 2 + random() % 11, cells = 4 + random() % 13, terms = 1 + random() % 6;
    std::vector<float> v(3 * cells), radiance, weights;
    for (float& number : v) number = uniform(random);
    for (size_t i = 0; i < samples; ++i) {
      const float mean = uniform(random), u = uniform(random);
      for (const float number : v) radiance.push_back(mean + u * number);
    }
    for (size_t i = 0; i < samples * cells; ++i) weights.push_back(uniform(random) < 0.3f ? 1.0f : 0.0f);
    const Factors factors = factorized({samples, cells, radiance, weights},
                                       {.terms = terms, .mostIterations = 200, .convergence = 0});
    const std::vector<float> values = product(factors, terms);
    EXPECT_TRUE(std::ranges::all_of(values, [](float value) { return std::isfinite(value); }));
    far += !std::ranges::all_of(values, [](float value) { return std::abs(value) < 20; });
  }
  EXPECT_LT(far, 3u);
}

// All directions but a few were extrapolated wrongly.
TEST(Factorization, TheToleranceIsJudgedByObservedEntries) {
  const GlossyMatrix full = small();
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    const FactorizationOptions options{.method = method, .terms = 8, .tolerance = 0.03, .leastWeight = 0.02f};
    GlossyMatrix matrix = full;
    matrix.weights.assign(matrix.samples * matrix.cells, 1);
    for (size_t i = 0; i < matrix.weights.size(); ++i)
      if (i % matrix.cells % 4 == 0) {
        matrix.weights[i] = 0;
        matrix.radiance[3 * i] += i / matrix.cells % 2 ? 0.5f : 0;
      }
    const Factors factors = factorized(matrix.view(), options);
    const size_t terms = factors.terms.size();
    EXPECT_LT(terms, options.terms);
    EXPECT_LE(errorOf(factors, terms, matrix.view()).rms(), options.tolerance);
    const std::vector<float> all(matrix.weights.size(), 1);
    EXPECT_GT(errorOf(factors, terms, {matrix.samples, matrix.cells, matrix.radiance, all}).rms(),
              2 * options.tolerance);
  }
}

TEST(Factorization, UnobservedSamplesAndCellsAreProjected) {
  const GlossyMatrix full = small();
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    GlossyMatrix matrix = full;
    matrix.weights.assign(matrix.samples * matrix.cells, 1);
    for (size_t i = 0; i < matrix.weights.size(); ++i)
      if (i / matrix.cells % 9 == 4 || i % matrix.cells % 7 == 3) matrix.weights[i] = 0;
    const Factors factors = factorized(matrix.view(), {.method = method, .terms = 4});
    std::vector<float> weights;
    EXPECT_LT(errorOf(factors, 4, holesOf(matrix, weights)).rms(),
              1.6 * errorOf(factors, 4, matrix.view()).rms());
  }
}

TEST(Factorization, EntriesThatAreNotFiniteAreNotObserved) {
  GlossyMatrix matrix = withHoles(0.1);
  const std::vector<float> expected = product(factorized(matrix.view(), {}), 3);
  for (size_t i = 0; i < matrix.weights.size(); ++i)
    if (matrix.weights[i] == 0)
      matrix.radiance[3 * i + i % 3] =
          i % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
  matrix.weights.clear();
  const Factors factors = factorized(matrix.view(), {});
  EXPECT_EQ(product(factors, 3), expected);
}

TEST(Factorization, NothingObservedOrAllBlackHasNoTerms) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    const std::vector<float> black(3 * 20 * 16, 0.0f), none(20 * 16, 0.0f);
    EXPECT_TRUE(factorized({20, 16, black, {}}, {.method = method}).terms.empty());
    const Factors unseen = factorized({20, 16, black, none}, {.method = method});
    EXPECT_TRUE(unseen.terms.empty());
    EXPECT_EQ(errorOf(unseen, 0, {20, 16, black, none}).rms(), 0);
    EXPECT_TRUE(factorized({0, 0, {}, {}}, {.method = method}).terms.empty());
  }
}

TEST(Factorization, RejectsWrongSizesWeightsAndNegativeRadiance) {
  GlossyMatrix matrix = small();
  const auto problem = [&](const FactorizationOptions& options) -> std::string {
    try {
      factorized(matrix.view(), options);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  matrix.weights = {1};
  EXPECT_EQ(problem({}), "weights: found 1, expected 7680 numbers");
  matrix.weights.assign(matrix.samples * matrix.cells, 1);
  matrix.weights[5] = -2;
  EXPECT_EQ(problem({}), "weights[5]: found -2, expected a finite number >= 0");
  matrix.weights.clear();
  matrix.radiance[4] = -0.5f;
  EXPECT_EQ(problem({.method = Factorization::nmf}), "radiance[4]: found -0.5, expected a number >= 0");
  EXPECT_EQ(problem({}), "");
  matrix.radiance.pop_back();
  EXPECT_EQ(problem({}), "radiance: found 23039, expected 23040 numbers");
}

TEST(Nmf, IsNonnegativeAndItsErrorNeverRises) {
  for (const GlossyMatrix& matrix : {small(), withHoles(0.3)}) {
    double before = std::numeric_limits<double>::infinity();
    for (const size_t iterations : {1u, 2u, 4u, 8u, 16u, 32u}) {
      const Factors factors = factorized(
          matrix.view(), {.method = Factorization::nmf, .mostIterations = iterations, .convergence = 0});
      EXPECT_TRUE(factors.mean.empty());
      for (const FactorTerm& term : factors.terms) {
        for (const float u : term.surface) EXPECT_GE(u, 0);
        for (const float v : term.view) EXPECT_GE(v, 0);
      }
      const double error = errorOf(factors, 3, matrix.view()).rms();
      EXPECT_LE(error, before * (1 + 1e-6));
      before = error;
    }
  }
}

TEST(Nmf, IsAtLeastAsGoodAsTheUpdatesOfTheAppendix) {
  const GlossyMatrix matrix = small();
  MatrixXd f(matrix.samples, 3 * matrix.cells);
  for (size_t i = 0; i < matrix.radiance.size(); ++i)
    f(i / (3 * matrix.cells), i % (3 * matrix.cells)) = double{matrix.radiance[i]};
  const ReferenceFactors reference = referenceNmf(f, 3, 400);
  const double expected =
      std::sqrt((f - reference.u * reference.v.transpose()).squaredNorm() / static_cast<double>(f.size()));
  const FactorizationOptions options{
      .method = Factorization::nmf, .terms = 3, .mostIterations = 100, .convergence = 1e-5};
  EXPECT_LT(rms(matrix, options), 1.02 * expected);
  EXPECT_GT(rms(matrix, options), rms(matrix, {.terms = 2})) << "a mean and two terms of any sign fit better";
}

TEST(Nmf, ZeroRowsAndColumnsStayZeroAndAConstantMatrixIsExact) {
  GlossyMatrix matrix = small();
  for (size_t i = 0; i < matrix.radiance.size(); ++i)
    if (i / (3 * matrix.cells) == 3 || i / 3 % matrix.cells == 5) matrix.radiance[i] = 0;
  const Factors factors = factorized(matrix.view(), {.method = Factorization::nmf});
  const std::vector<float> radiance = product(factors, factors.terms.size());
  for (size_t i = 0; i < radiance.size(); ++i)
    if (i / (3 * matrix.cells) == 3 || i / 3 % matrix.cells == 5) {
      EXPECT_EQ(radiance[i], 0);
    }

  const std::vector<float> grey(3 * 30 * 20, 0.4f);
  const Factors constant = factorized({30, 20, grey, {}}, {.method = Factorization::nmf, .terms = 1});
  for (const float value : product(constant, 1)) EXPECT_NEAR(value, 0.4f, 1e-6);
}

TEST(Nmf, TakesFewerTermsWithinATolerance) {
  const GlossyMatrix matrix = small();
  const FactorizationOptions options{.method = Factorization::nmf, .terms = 8, .tolerance = 0.03};
  const Factors factors = factorized(matrix.view(), options);
  EXPECT_LE(errorOf(factors, 8, matrix.view()).rms(), 0.03);
  EXPECT_LT(factors.terms.size(), 8u);
}

} // namespace
} // namespace surflect::lfm
