#include "srf/model/view_penalties.h"

#include "srf/model/view_chooser.h"
#include "tests/srf/model/queries.h"

namespace surflect::model {
namespace {

using namespace studio;

class ViewsRated : public ProductQueries {
protected:
  // Each surfel is seen by a share of the views of its own, most of them fading.
  void fade() {
    std::uniform_real_distribution<double> share(0, 1);
    for (size_t i = 0; i < model.cloud.size(); ++i) {
      const double own = i % 4 == 0 ? 0 : share(random);
      for (size_t view = 0; view < model.fades.views; ++view)
        model.fades.values[i * model.fades.views + view] =
            share(random) < own ? static_cast<uint8_t>(1 + random() % 255) : uint8_t{0};
    }
  }
};

TEST_F(ViewsRated, WhatIsPassedOverWouldNotBeBlended) {
  fade();
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  for (const Simd simd : supportedSimd()) {
    ViewPenalties views(model, false, simd);
    size_t standIns = 0;
    for (size_t i = 0; i < batch.size(); ++i) {
      const auto [blend, sight] = views.blend(batch.surfels[i], batch.towardsView[i], 4);
      const Sight rated = views.rate(batch.surfels[i], batch.towardsView[i]);
      EXPECT_EQ(sight.isSeen, rated.isSeen);
      EXPECT_EQ(sight.penalty, rated.penalty);
      ulr::NearestCandidates nearest(4);
      for (uint32_t view = 0; view < model.fades.views; ++view) nearest.offer({view, views.with(view, 0)});
      EXPECT_EQ(sight.penalty, nearest.sorted()[0].penalty);
      const ulr::BlendSet wanted = ulr::ulrWeights(nearest);
      ASSERT_EQ(blend.size(), wanted.size());
      for (size_t j = 0; j < blend.size(); ++j) {
        EXPECT_EQ(blend[j].index, wanted[j].index);
        EXPECT_EQ(blend[j].weight, wanted[j].weight);
        if (model.fades.of(batch.surfels[i])[blend[j].index] == 0) ++standIns;
      }
    }
    EXPECT_GT(standIns, 500u);
  }
}

TEST_F(ViewsRated, ChoosingManyAtOnceIsChoosingOneByOne) {
  fade();
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  for (const Simd simd : supportedSimd())
    for (const bool nearest : {false, true}) {
      const ShadeOptions options{.cameras = 4, .nearest = nearest, .simd = simd};
      ViewPenalties views(model, nearest, simd);
      ViewChooser chooser(model, batch, options);
      for (size_t begin = 0; begin < batch.size(); begin += ulr::kChoiceLanes) {
        chooser.choose(begin, ulr::kChoiceLanes);
        for (size_t lane = 0; lane < ulr::kChoiceLanes; ++lane) {
          const size_t query = begin + lane;
          const auto wanted =
              views.blend(batch.surfels[query], batch.towardsView[query], nearest ? 1 : options.cameras);
          std::vector<double> difference(model.fades.views);
          const Sight sight =
              chooser.forEach(lane, [&](uint32_t view, float weight) { difference[view] += weight; });
          EXPECT_EQ(sight.isSeen, wanted.sight.isSeen);
          EXPECT_NEAR(ulr::confidenceOf(sight.penalty), ulr::confidenceOf(wanted.sight.penalty), 1e-5);
          for (const auto& [view, weight] : wanted.blend) difference[view] -= weight;
          for (const double d : difference) EXPECT_NEAR(d, 0, 1e-5);
        }
      }
    }
}

} // namespace
} // namespace surflect::model
