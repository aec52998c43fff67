#include "srf/weights/camera_weights.h"

#include "tests/srf/shading/queries.h"
#include "tests/support/each_simd.h"

namespace surflect::weights {
namespace {

using namespace studio;

class CameraWeightsOfStudio : public ProductQueries {
protected:
  // Makes each surfel visible in a random subset of the views, partly faded in most.
  void fade() {
    std::uniform_real_distribution<double> share(0, 1);
    for (size_t i = 0; i < model.cloud.size(); ++i) {
      const double own = i % 4 == 0 ? 0 : share(random);
      for (size_t view = 0; view < model.visibility.views; ++view)
        model.visibility.values[i * model.visibility.views + view] =
            share(random) < own ? static_cast<uint8_t>(1 + random() % 255) : uint8_t{0};
    }
  }
};

TEST_F(CameraWeightsOfStudio, FallbacksPassedOverWouldNotBeBlended) {
  fade();
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  for ([[maybe_unused]] const Simd simd : EachSimd()) {
    CameraWeights views(model, batch, {.cameras = 4});
    size_t fallbacks = 0;
    for (size_t i = 0; i < batch.size(); ++i) {
      const auto [blend, best] = views.blend(i);
      const BestView rated = views.computePenalties(i);
      EXPECT_EQ(best.isSeen, rated.isSeen);
      EXPECT_EQ(best.penalty, rated.penalty);
      NearestCandidates nearest(4);
      for (uint32_t view = 0; view < model.visibility.views; ++view)
        nearest.offer({view, views.penalty(view, 0)});
      EXPECT_EQ(best.penalty, nearest.sorted()[0].penalty);
      const BlendSet wanted = ulrWeights(nearest);
      ASSERT_EQ(blend.size(), wanted.size());
      for (size_t j = 0; j < blend.size(); ++j) {
        EXPECT_EQ(blend[j].index, wanted[j].index);
        EXPECT_EQ(blend[j].weight, wanted[j].weight);
        if (model.visibility.of(batch.surfels[i])[blend[j].index] == 0) ++fallbacks;
      }
    }
    EXPECT_GT(fallbacks, 500u);
  }
}

TEST_F(CameraWeightsOfStudio, WeightsOfManyQueriesAreThoseOfEachAlone) {
  fade();
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (const bool nearest : {false, true}) {
      const ShadeOptions options{.cameras = 4, .nearest = nearest};
      CameraWeights alone(model, batch, options), many(model, batch, options);
      for (size_t begin = 0; begin < batch.size(); begin += kQueryLanes) {
        many.prepare(begin, kQueryLanes);
        for (size_t lane = 0; lane < kQueryLanes; ++lane) {
          const auto wanted = alone.blend(begin + lane);
          std::vector<double> difference(model.visibility.views);
          const BestView best =
              many.forEach(lane, [&](uint32_t view, float weight) { difference[view] += weight; });
          EXPECT_EQ(best.isSeen, wanted.best.isSeen);
          EXPECT_NEAR(confidenceOf(best.penalty), confidenceOf(wanted.best.penalty), 1e-5);
          for (const auto& [view, weight] : wanted.weights) difference[view] -= weight;
          for (const double d : difference) EXPECT_NEAR(d, 0, 1e-5);
        }
      }
    }
}

} // namespace
} // namespace surflect::weights
