#include "render/lightfield/lfm/vector_quantization.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace surflect::lfm {
namespace {

constexpr CodebookStart kStarts[] = {CodebookStart::split, CodebookStart::pairwiseNearestNeighbors};

// Waves of random phase, frequency and height, rounded to bytes.
std::vector<float> waves(size_t count, size_t dimension, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform;
  std::vector<float> values;
  for (size_t i = 0; i < count; ++i) {
    const double phase = 6 * uniform(random), frequency = 5 * uniform(random), height = 127 * uniform(random);
    for (size_t d = 0; d < dimension; ++d)
      values.push_back(static_cast<float>(std::round(
          height * std::sin(phase + frequency * static_cast<double>(d) / static_cast<double>(dimension)))));
  }
  return values;
}

double squareTo(const Codebook& codebook, const VectorSet& set, size_t vector, size_t codeword) {
  double sum = 0;
  for (size_t d = 0; d < set.dimension; ++d)
    sum +=
        std::pow(double{set.values[vector * set.dimension + d]} - double{codebook.codeword(codeword)[d]}, 2);
  return sum;
}

double distortionOf(const Codebook& codebook, const VectorSet& set) {
  double sum = 0, weights = 0;
  for (size_t i = 0; i < set.size(); ++i) {
    const double weight = set.weights.empty() ? 1 : double{set.weights[i]};
    sum += weight * squareTo(codebook, set, i, codebook.indices[i]);
    weights += weight;
  }
  return sum / (weights * static_cast<double>(set.dimension));
}

TEST(VectorQuantization, DistortionFallsMonotonicallyAndIsThatOfTheIndices) {
  const std::vector<float> values = waves(400, 30);
  const VectorSet set{30, values, {}};
  for (const CodebookStart start : kStarts) {
    const Codebook codebook = codebookOf(set, {.start = start, .codewords = 37, .convergence = 0});
    EXPECT_EQ(codebook.size(), 37u);
    EXPECT_GT(codebook.distortions.size(), 2u);
    EXPECT_TRUE(std::ranges::is_sorted(codebook.distortions, std::greater{}));
    EXPECT_NEAR(codebook.distortions.back(), distortionOf(codebook, set), 1e-9);
  }
}

TEST(VectorQuantization, EveryVectorHasItsNearestCodeword) {
  const std::vector<float> values = waves(300, 25);
  const VectorSet set{25, values, {}};
  for (const CodebookStart start : kStarts) {
    const Codebook codebook = codebookOf(set, {.start = start, .codewords = 20, .mostIterations = 3});
    for (size_t i = 0; i < set.size(); ++i)
      for (size_t c = 0; c < codebook.size(); ++c)
        EXPECT_LE(squareTo(codebook, set, i, codebook.indices[i]), squareTo(codebook, set, i, c));
  }
}

TEST(VectorQuantization, MoreCodewordsHaveLessDistortionAndSoDoMergedOnesIfTheyAreMany) {
  const std::vector<float> values = waves(500, 40);
  const VectorSet set{40, values, {}};
  double before = std::numeric_limits<double>::infinity();
  for (const size_t codewords : {1u, 5u, 25u, 125u}) {
    const double split = codebookOf(set, {.codewords = codewords}).distortions.back();
    EXPECT_LT(split, before);
    before = split;
    if (codewords < 125) continue;
    EXPECT_LT(codebookOf(set, {.start = CodebookStart::pairwiseNearestNeighbors, .codewords = codewords})
                  .distortions.back(),
              split);
  }
}

TEST(VectorQuantization, ReachesTheDistortionAskedForWithFewCodewords) {
  const std::vector<float> values = waves(500, 40);
  const VectorSet set{40, values, {}};
  for (const CodebookStart start : kStarts)
    for (const double distortion : {400.0, 100.0, 25.0}) {
      const Codebook codebook = codebookOf(set, {.start = start, .distortion = distortion});
      EXPECT_LE(codebook.distortions.back(), distortion);
      // Three quarters of the codewords are not enough.
      EXPECT_GT(codebookOf(set, {.start = start, .codewords = codebook.size() * 3 / 4}).distortions.back(),
                distortion);
    }
}

TEST(VectorQuantization, SeparateClustersAreFoundWithTheirCentroids) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> near(-1, 1);
  std::vector<float> values;
  for (int i = 0; i < 90; ++i)
    for (int d = 0; d < 6; ++d) values.push_back(static_cast<float>(100 * (i % 3 == d % 3)) + near(random));
  const VectorSet set{6, values, {}};
  for (const CodebookStart start : kStarts) {
    const Codebook codebook = codebookOf(set, {.start = start, .codewords = 3});
    for (size_t i = 0; i < 90; ++i) EXPECT_EQ(codebook.indices[i], codebook.indices[i % 3]);
    for (size_t c = 0; c < 3; ++c)
      for (size_t d = 0; d < 6; ++d) {
        double mean = 0;
        for (size_t i = c; i < 90; i += 3) mean += double{values[6 * i + d]} / 30;
        EXPECT_NEAR(codebook.codeword(codebook.indices[c])[d], mean, 1e-4);
      }
  }
}

TEST(VectorQuantization, ACodebookAsLargeAsTheSetIsTheSetOfDistinctVectors) {
  std::vector<float> values = waves(20, 12);
  for (size_t i = 0; i < 12; ++i) values[5 * 12 + i] = values[2 * 12 + i]; // a vector that occurs twice
  const VectorSet set{12, values, {}};
  for (const CodebookStart start : kStarts)
    for (const size_t codewords : {0u, 19u, 1000u}) {
      const Codebook codebook = codebookOf(set, {.start = start, .codewords = codewords});
      EXPECT_EQ(codebook.size(), 19u);
      EXPECT_EQ(codebook.indices[5], codebook.indices[2]);
      EXPECT_EQ(distortionOf(codebook, set), 0);
    }
}

TEST(VectorQuantization, AWeightIsAsGoodAsRepetition) {
  const std::vector<float> values = waves(60, 10);
  std::vector<float> repeated = values;
  std::vector<float> weights(60, 1);
  for (size_t i = 0; i < 60; i += 3) {
    weights[i] = 2;
    repeated.insert(repeated.end(), values.begin() + static_cast<std::ptrdiff_t>(10 * i),
                    values.begin() + static_cast<std::ptrdiff_t>(10 * i + 10));
  }
  const CodebookOptions options{.codewords = 8};
  EXPECT_EQ(codebookOf({10, values, weights}, options).codewords,
            codebookOf({10, repeated, {}}, options).codewords);
}

TEST(VectorQuantization, IsTheSameForAnyNumberOfThreads) {
  const std::vector<float> values = waves(300, 48);
  const CodebookOptions options{.codewords = 30};
  const Codebook many = codebookOf({48, values, {}}, options);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Codebook few = codebookOf({48, values, {}}, options);
  EXPECT_EQ(many.codewords, few.codewords);
  EXPECT_EQ(many.indices, few.indices);
}

TEST(VectorQuantization, RejectsWhatIsNotFiniteAndAnEmptySetIsEmpty) {
  std::vector<float> values = waves(3, 4);
  values[6] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(codebookOf({4, values, {}}, {}), Error);
  EXPECT_THROW(codebookOf({5, waves(3, 4), {}}, {}), Error);
  values[6] = 0;
  const std::vector<float> weights = {1, 0, 1};
  EXPECT_THROW(codebookOf({4, values, weights}, {}), Error);
  EXPECT_EQ(codebookOf({4, {}, {}}, {.codewords = 3}).size(), 0u);
}

} // namespace
} // namespace surflect::lfm
