#include "srf/weights/kriging.h"

#include "surfel/math/simd.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace surflect::weights {
namespace {

Direction3<AcquisitionSpace> anyDirection(std::mt19937& random) {
  return assume<Direction3<AcquisitionSpace>>(randomUnit(random));
}

PairPlace randomPlace(std::mt19937& random) {
  const auto light = anyDirection(random), view = anyDirection(random);
  return pairPlace(light, view, static_cast<float>(random() % 2), {});
}

std::vector<KrigingSample> randomSamples(size_t count, std::mt19937& random) {
  std::uniform_real_distribution<float> share(0, 1);
  std::vector<KrigingSample> samples;
  for (uint32_t i = 0; i < count; ++i) {
    const float near = share(random), confidence = share(random);
    samples.push_back({i, randomPlace(random), nuggetOf(near, confidence)});
  }
  return samples;
}

std::vector<double> weightsOf(const std::vector<KrigingSample>& samples, const PairPlace& asked) {
  std::vector<double> all(samples.size(), 0);
  for (const auto& [index, weight] : krigingWeights(samples, asked)) all[index] = weight;
  return all;
}

TEST(Kriging, WeightsAreThoseOfTheWholeSystemInDoublePrecision) {
  std::mt19937 random(1);
  for (size_t count = 1; count <= kMaxBlended; ++count)
    for (int trial = 0; trial < 50; ++trial) {
      const auto samples = randomSamples(count, random);
      const PairPlace asked = randomPlace(random);
      const auto fast = weightsOf(samples, asked), exact = krigingWeightsReference(samples, asked);
      for (size_t i = 0; i < count; ++i) EXPECT_NEAR(fast[i], exact[i], 2e-4);
    }
}

TEST(SimpleKriging, WeightsAreThoseOfTheWholeSystemInDoublePrecision) {
  std::mt19937 random(11);
  for (size_t count = 1; count <= kMaxBlended; ++count)
    for (int trial = 0; trial < 50; ++trial) {
      const auto samples = randomSamples(count, random);
      const PairPlace asked = randomPlace(random);
      const BlendSet fast = simpleKrigingWeights(samples, asked);
      const auto exact = simpleKrigingWeightsReference(samples, asked);
      ASSERT_EQ(fast.size(), count);
      for (size_t i = 0; i < count; ++i) EXPECT_NEAR(fast[i].weight, exact[i], 2e-4);
    }
}

TEST(SimpleKriging, TheSumOfWeightsFallsWithTheDistance) {
  KrigingSample sample{0, {}, 0};
  float before = 1.01f;
  for (float distance = 0; distance < 6; distance += 0.5f) {
    PairPlace asked{};
    asked[0] = distance;
    const float weight = simpleKrigingWeights({&sample, 1}, asked)[0].weight;
    EXPECT_NEAR(weight, matern52(distance * distance), 1e-6);
    EXPECT_LT(weight, before);
    before = weight;
  }
}

// Neighbours in the lanes, earlier requests, and the instruction set change no bit.
TEST(KrigingBatch, HasTheBitsOfSingleRequests) {
  std::mt19937 random(12);
  KrigingBatch batch;
  for (int round = 0; round < 3; ++round) {
    std::vector<std::vector<KrigingSample>> samples;
    std::vector<PairPlace> asked;
    batch.clear();
    for (size_t request = 0; request < 21; ++request) {
      samples.push_back(
          randomSamples((7 * request + 5 * static_cast<size_t>(round)) % (kMaxBlended + 1), random));
      asked.push_back(randomPlace(random));
      EXPECT_EQ(batch.ask(asked.back()), request);
      for (const KrigingSample& sample : samples.back()) batch.add(sample);
    }
    for (const Simd simd : supportedSimd())
      for (const bool isSimple : {false, true}) {
        useSimd(simd);
        isSimple ? batch.solveSimple() : batch.solve();
        useSimd(supportedSimd().back());
        for (size_t request = 0; request < samples.size(); ++request) {
          const BlendSet got = isSimple ? batch.weights(request) : batch.positiveWeights(request);
          const BlendSet wanted = isSimple ? simpleKrigingWeights(samples[request], asked[request])
                                           : krigingWeights(samples[request], asked[request]);
          ASSERT_EQ(got.size(), wanted.size());
          for (size_t i = 0; i < got.size(); ++i) {
            EXPECT_EQ(got[i].index, wanted[i].index);
            EXPECT_EQ(got[i].weight, wanted[i].weight);
          }
        }
      }
  }
}

TEST(Kriging, WeightsArePositiveAndSumToOne) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 500; ++trial) {
    const auto weights = weightsOf(randomSamples(1 + random() % kMaxBlended, random), randomPlace(random));
    EXPECT_NEAR(std::accumulate(weights.begin(), weights.end(), 0.0), 1, 1e-5);
    EXPECT_GE(*std::ranges::min_element(weights), 0);
  }
}

// Epipole consistency: a photograph that is met answers alone.
TEST(Kriging, APhotographThatIsMetHasAllWeight) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    auto samples = randomSamples(8, random);
    samples[3].nugget = nuggetOf(0, 1);
    EXPECT_NEAR(weightsOf(samples, samples[3].place)[3], 1, 1e-3);
  }
}

TEST(Kriging, APhotographWithoutConfidenceHasNoWeight) {
  std::mt19937 random(4);
  auto samples = randomSamples(5, random);
  samples[2].nugget = nuggetOf(0.5f, 0);
  EXPECT_LT(weightsOf(samples, samples[2].place)[2], 1e-5);
  samples[2].nugget = nuggetOf(1, 1);
  EXPECT_LT(weightsOf(samples, samples[2].place)[2], 1e-4);
}

TEST(Kriging, EqualPhotographsShareTheirWeight) {
  std::mt19937 random(5);
  const PairPlace place = randomPlace(random), asked = randomPlace(random);
  const auto weights = weightsOf({{0, place, 0.01f}, {1, place, 0.01f}}, asked);
  EXPECT_NEAR(weights[0], 0.5, 1e-4);
}

// A path of one photograph's place and nugget through a blend: the largest change falls with the step.
TEST(Kriging, WeightsChangeContinuously) {
  std::mt19937 random(6);
  for (int path = 0; path < 100; ++path) {
    const auto samples = randomSamples(6, random);
    const PairPlace from = randomPlace(random), to = randomPlace(random);
    const auto largestChange = [&](int steps) {
      double largest = 0;
      std::vector<double> before;
      for (int step = 0; step <= steps; ++step) {
        const float t = static_cast<float>(step) / static_cast<float>(steps);
        PairPlace asked;
        for (size_t i = 0; i < asked.size(); ++i) asked[i] = (1 - t) * from[i] + t * to[i];
        const auto weights = weightsOf(samples, asked);
        for (size_t i = 0; i < before.size(); ++i)
          largest = std::max(largest, std::abs(weights[i] - before[i]));
        before = weights;
      }
      return largest;
    };
    const double coarse = largestChange(400);
    EXPECT_LT(largestChange(800), 0.6 * coarse + 1e-4);
  }
}

TEST(Kriging, MaternCovarianceFallsFromOneAndItsSlopeIsZeroAtZero) {
  EXPECT_EQ(matern52(0.0), 1);
  EXPECT_NEAR((matern52(1e-8) - 1) / 1e-8, -5.0 / 6, 1e-4); // 1 - 5/6 d^2 + ..
  EXPECT_NEAR(matern52(1.0), (1 + std::sqrt(5.0) + 5.0 / 3) * std::exp(-std::sqrt(5.0)), 1e-15);
}

TEST(Kriging, MirroredPairsShareTheirHalfVector) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 100; ++trial) {
    const auto light = anyDirection(random), view = anyDirection(random);
    EXPECT_LT((halfVector(light.raw(), view.raw()) - halfVector(view.raw(), light.raw())).norm(), 1e-6);
  }
  const Vec3<float> x(1, 0, 0);
  EXPECT_EQ(halfVector(x, x), x);
  EXPECT_EQ(halfVector(x, -x), Vec3<float>::Zero());
}

} // namespace
} // namespace surflect::weights
