#include "srf/shading/plan.h"

#include "srf/weights/fallback_view.h"
#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/ulr.h"
#include "tests/srf/shading/queries.h"

#include <limits>
#include <tuple>

namespace surflect::shading {
namespace {

using namespace studio;

class ShadingPlanned : public ProductQueries {};
// Cameras and lights of pairs weighted apart; by distance, see pair_weights_test.cpp.
class ShadingPlannedPairs : public PairQueries {
protected:
  ShadingPlannedPairs() { model.interpolation.kind = weights::Interpolation::separate; }
};

// The studio's lights with a common colour; each keeps its strength in blue.
std::vector<capture::Light> inOneColor(std::vector<capture::Light> lights) {
  for (capture::Light& light : lights) {
    Rgb& irradiance = std::get<capture::DirectionalLight>(light.kind).irradiance;
    irradiance = irradiance.r * Rgb{0.3f, 0.7f, 1.1f};
  }
  return lights;
}

TEST_F(ShadingPlanned, WeightsOfCamerasAndOfLightsSumToOne) {
  for (const auto& [lights, unevenness, isOneColor] :
       {std::tuple(1, 0., false), {3, 0., false}, {3, 0.5, false}, {3, 0., true}, {3, 0.5, true}}) {
    model.rig.lights = studioLights(Studio{}.lights, unevenness);
    if (isOneColor) model.rig.lights = inOneColor(model.rig.lights);
    const weights::QueryBatch batch = randomBatch(model, 2000, lights, random);
    const ShadingPlan plan =
        planShading(model, batch, {.lightFit = weights::LightFit::mean, .foreshortened = false});
    EXPECT_EQ(plan.unseen, 0u);
    std::vector<double> sums(batch.size());
    for (const ShadingOp& op : plan.ops) {
      EXPECT_GT(op.weight, 0);
      sums[op.target] += op.weight;
      double got = 0, wanted = 0; // irradiance that the row reproduces from captured lights
      for (const auto& [column, weight] : rowOf(plan, op))
        got += weight.g * capturedIrradiance(model, op, column, batch.surfels[op.target]).g;
      for (size_t l = 0; l < batch.lights; ++l) wanted += batch.irradiance[op.target * batch.lights + l].g;
      EXPECT_NEAR(got / wanted, 1, 3.5e-7);
    }
    for (const double sum : sums) EXPECT_NEAR(sum, 1, 2.7e-7);
  }
}

// Rows of sixteen queries are made together if all lights have one colour, unless blend colours are
// requested.
TEST_F(ShadingPlanned, RowsThatAreMadeTogetherAreThoseOfEachAlone) {
  model.rig.lights = inOneColor(model.rig.lights);
  weights::ShadeOptions options{.lights = 2, .lightFit = weights::LightFit::mean, .foreshortened = false};
  const weights::QueryBatch batch = randomBatch(model, 2000, 2, random);
  ASSERT_LE(2 * batch.lights * *options.lights, model.rig.lights.size());
  weights::QueryBatch dimmed = batch;
  for (size_t query = 5; query < batch.size(); query += weights::kQueryLanes)
    dimmed.irradiance[2 * query + 1] = {};
  const ShadingPlan together = planShading(model, batch, options),
                    apart = planShading(model, dimmed, options);
  options.showsBlends = true;
  const ShadingPlan shown = planShading(model, batch, options);

  ASSERT_EQ(together.ops.size(), apart.ops.size());
  ASSERT_EQ(together.ops.size(), shown.ops.size());
  for (size_t i = 0; i < together.ops.size(); ++i) {
    auto row = rowOf(together, together.ops[i]);
    ASSERT_EQ(row.size(), 4u);
    EXPECT_EQ(row, rowOf(shown, shown.ops[i]));
    EXPECT_EQ(together.ops[i].rowEnd - together.ops[i].rowBegin, 2u); // one colour for each light
    const bool isDimmed = together.ops[i].target % weights::kQueryLanes == 5;
    if (isDimmed) row.resize(2);
    EXPECT_EQ(row, rowOf(apart, apart.ops[i]));
  }
}

// Per channel, whether captured lights are blended before colouring or each has its own colour.
TEST_F(ShadingPlanned, RowsGiveBackTheIrradianceOfLampsOfAnyColours) {
  const weights::ShadeOptions options{
      .lights = 3, .lightFit = weights::LightFit::mean, .foreshortened = false};
  const std::vector<capture::Light> various = model.rig.lights;
  for (const bool isOneColor : {true, false}) {
    model.rig.lights = isOneColor ? inOneColor(various) : various;
    const weights::QueryBatch batch = randomBatch(model, 500, 2, random);
    const ShadingPlan plan = planShading(model, batch, options);
    for (const ShadingOp& op : plan.ops) {
      EXPECT_EQ(op.rowEnd - op.rowBegin, isOneColor ? 2u : 6u);
      Rgb got, wanted;
      for (const auto& [column, weight] : rowOf(plan, op))
        got = got + weight * capturedIrradiance(model, op, column, batch.surfels[op.target]);
      for (size_t l = 0; l < 2; ++l) wanted = wanted + batch.irradiance[2 * op.target + l];
      EXPECT_NEAR(got.r / wanted.r, 1, 7e-7);
      EXPECT_NEAR(got.g / wanted.g, 1, 7e-7);
      EXPECT_NEAR(got.b / wanted.b, 1, 7e-7);
    }
  }
}

// The least penalty of angle over fade. Fallback views are tested in camera_weights_test.cpp.
void expectConfidenceIsThatOfTheBestView(const model::Model& model, const weights::QueryBatch& batch) {
  const ShadingPlan plan = planShading(model, batch, {});
  ASSERT_EQ(plan.confidence.size(), batch.size());
  for (size_t query = 0; query < batch.size(); ++query) {
    const auto visibility = model.visibility.of(batch.surfels[query]);
    const auto place = model.cloud.p0[batch.surfels[query]].cast<double>();
    float best = std::numeric_limits<float>::infinity();
    for (size_t view = 0; view < visibility.size(); ++view) {
      const auto towards = capture::Viewpoint(model.rig.views[view].camera).towards(place).cast<float>();
      if (visibility[view] > 0)
        best = std::min(best, weights::anglePenalty(towards, batch.towardsView[query]) /
                                  weights::VisibilityWeights::decode(visibility[view]));
    }
    ASSERT_LE(best, weights::kFallbackFrom);
    EXPECT_NEAR(plan.confidence[query], weights::confidenceOf(best), 2e-5);
  }
}

TEST_F(ShadingPlanned, ConfidenceIsThatOfTheBestView) {
  expectConfidenceIsThatOfTheBestView(model, randomBatch(model, 2000, 1, random));
}

TEST_F(ShadingPlannedPairs, ConfidenceIsThatOfTheBestView) {
  expectConfidenceIsThatOfTheBestView(model, randomBatch(model, 300, 2, random));
}

TEST_F(ShadingPlanned, ForeshortenedLightsKeepTheIrradianceOfTheSurface) {
  const weights::QueryBatch batch = randomBatch(model, 2000, 1, random);
  const ShadingPlan plan = planShading(model, batch, {.foreshortened = true});
  size_t lit = 0;
  for (const ShadingOp& op : plan.ops) {
    const uint32_t surfel = batch.surfels[op.target];
    const auto normal = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(model.cloud.r0[surfel]).col(2));
    const float cosine = weights::foreshortenedCosine(normal, batch.towardsLight[op.target]);
    double got = 0;
    for (const auto& [column, weight] : rowOf(plan, op)) {
      const capture::Light& light = model.rig.lights[model.columns[op.view][column]];
      got += weight.g * capturedIrradiance(model, op, column, surfel).g *
             weights::foreshortenedCosine(
                 normal, capture::towardsLight(light, model.cloud.p0[surfel].cast<double>()).cast<float>());
    }
    const double wanted = batch.irradiance[op.target].g * cosine;
    if (cosine > 0.5f) { // at grazing angles the ratio may be capped
      EXPECT_NEAR(got / wanted, 1, 2e-3);
      ++lit;
    }
    if (cosine == 0) {
      EXPECT_LT(got, 2e-3 * batch.irradiance[op.target].g);
    }
  }
  EXPECT_GT(lit, plan.ops.size() / 8);
}

TEST_F(ShadingPlanned, OnlyCamerasThatSeeTheSurfelAreAsked) {
  const weights::QueryBatch batch = randomBatch(model, 2000, 1, random);
  for (const ShadingOp& op : planShading(model, batch, {}).ops)
    EXPECT_GT(model.visibility.of(batch.surfels[op.target])[op.view], 0);
}

TEST_F(ShadingPlanned, WhereNoCameraSeesOthersStandIn) {
  const weights::QueryBatch batch = randomBatch(model, 300, 1, random);
  std::ranges::fill(model.visibility.values, uint8_t{0});
  const ShadingPlan plan = planShading(model, batch, {});
  EXPECT_EQ(plan.unseen, batch.size());
  std::vector<double> sums(batch.size());
  for (const ShadingOp& op : plan.ops) {
    EXPECT_GT(op.weight, 0);
    EXPECT_TRUE(capture::contains(model.rig.views[op.view].camera.lens, {op.x, op.y}));
    sums[op.target] += op.weight;
  }
  for (const double sum : sums) EXPECT_NEAR(sum, 1, 2.7e-7);
}

TEST_F(ShadingPlanned, AStandInHasNoWeightBesideACameraThatSees) {
  const weights::QueryBatch batch = randomBatch(model, 2000, 1, random);
  // One view sees each surfel, though others may be much nearer.
  for (size_t i = 0; i < model.cloud.size(); ++i) {
    const auto row =
        std::span(model.visibility.values).subspan(i * model.visibility.views, model.visibility.views);
    std::ranges::fill(row, uint8_t{0});
    row[i % model.visibility.views] = 255;
  }
  const ShadingPlan plan = planShading(model, batch, {});
  EXPECT_EQ(plan.unseen, 0u);
  size_t within90Degrees = 0;
  for (const ShadingOp& op : plan.ops) {
    const uint32_t surfel = batch.surfels[op.target];
    const size_t seeing = surfel % model.visibility.views;
    const auto towards = towardsViewer(model.rig.views[seeing], model.cloud.p0[surfel].cast<double>());
    if (weights::anglePenalty(towards.cast<float>(), batch.towardsView[op.target]) > 1) continue;
    ++within90Degrees;
    EXPECT_EQ(op.view, seeing);
  }
  EXPECT_GT(within90Degrees, batch.size() / 4);
}

TEST_F(ShadingPlanned, TheBaselineIsTheNearestCameraAndItsNearestLight) {
  const weights::QueryBatch batch = randomBatch(model, 1000, 1, random);
  const ShadingPlan plan = planShading(model, batch, {.nearest = true});
  ASSERT_EQ(plan.ops.size(), batch.size());
  for (const ShadingOp& op : plan.ops) {
    EXPECT_EQ(op.weight, 1);
    const auto p0 = model.cloud.p0[batch.surfels[op.target]].cast<double>();
    const auto visibility = model.visibility.of(batch.surfels[op.target]);
    const auto viewPenalty = [&](size_t view) {
      return weights::anglePenalty(towardsViewer(model.rig.views[view], p0),
                                   batch.towardsView[op.target].cast<double>());
    };
    for (size_t view = 0; view < visibility.size(); ++view)
      EXPECT_TRUE(visibility[view] == 0 || viewPenalty(op.view) <= viewPenalty(view) + 1e-6);
    ASSERT_EQ(rowOf(plan, op).size(), 1u);
    const auto lightPenalty = [&](const capture::Light& light) {
      return weights::anglePenalty(capture::towardsLight(light, p0),
                                   batch.towardsLight[op.target].cast<double>());
    };
    const capture::Light& chosen = model.rig.lights[rowOf(plan, op)[0].light];
    for (const capture::Light& light : model.rig.lights)
      EXPECT_LE(lightPenalty(chosen), lightPenalty(light) + 1e-6);
  }
}

TEST_F(ShadingPlanned, ALitCaptureNeedsALight) {
  const weights::QueryBatch batch = randomBatch(model, 10, 0, random);
  EXPECT_NE(image::errorOf([&] { planShading(model, batch, {}); }).find("must name a light"),
            std::string::npos);
}

TEST_F(ShadingPlannedPairs, WeightsOfThePairsOfEachLightSumToOne) {
  ASSERT_FALSE(model.isFullProduct);
  const weights::QueryBatch batch = randomBatch(model, 1000, 2, random);
  const ShadingPlan plan = planShading(model, batch, {});
  ASSERT_EQ(plan.targetsPerPlace, 2u);
  std::vector<double> sums(2 * batch.size()), irradiance(2 * batch.size());
  for (const ShadingOp& op : plan.ops) {
    EXPECT_GT(model.visibility.of(batch.surfels[op.target / 2])[op.view], 0);
    sums[op.target] += op.weight;
    for (const auto& [column, weight] : rowOf(plan, op)) {
      ASSERT_LT(column, model.columns[op.view].size());
      irradiance[op.target] +=
          op.weight * weight.r * capturedIrradiance(model, op, column, batch.surfels[op.target / 2]).r;
    }
  }
  for (size_t target = 0; target < sums.size(); ++target) {
    EXPECT_NEAR(sums[target], 1, 4.5e-7);
    EXPECT_NEAR(irradiance[target] / batch.irradiance[target].r, 1, 7e-7);
  }
}

TEST_F(ShadingPlannedPairs, ACapturedPairHasAllTheWeight) {
  const auto [batch, photographs] = capturedRays(model, random);
  ASSERT_GT(batch.size(), 2000u);
  const ShadingPlan plan = planShading(model, batch, {});
  std::vector<double> weight(batch.size());
  for (const ShadingOp& op : plan.ops)
    for (const auto& [column, factor] : rowOf(plan, op))
      if (std::pair(op.view, column) == photographs[op.target])
        weight[op.target] += op.weight * factor.r *
                             capturedIrradiance(model, op, column, batch.surfels[op.target]).r /
                             batch.irradiance[op.target].r;
  for (const double w : weight) EXPECT_NEAR(w, 1, 3e-7);
}

TEST_F(ShadingPlannedPairs, TheBaselineIsTheNearestPair) {
  const weights::QueryBatch batch = randomBatch(model, 500, 1, random);
  const ShadingPlan plan = planShading(model, batch, {.nearest = true});
  ASSERT_EQ(plan.ops.size(), batch.size());
  for (const ShadingOp& op : plan.ops) {
    const auto p0 = model.cloud.p0[batch.surfels[op.target]].cast<double>();
    const auto visibility = model.visibility.of(batch.surfels[op.target]);
    const auto penalty = [&](size_t view, size_t column) {
      const capture::Light& light = model.rig.lights[model.columns[view][column]];
      return weights::anglePenalty(towardsViewer(model.rig.views[view], p0),
                                   batch.towardsView[op.target].cast<double>()) +
             weights::anglePenalty(capture::towardsLight(light, p0),
                                   batch.towardsLight[op.target].cast<double>());
    };
    const double chosen = penalty(op.view, rowOf(plan, op)[0].light);
    for (size_t view = 0; view < visibility.size(); ++view)
      for (size_t column = 0; visibility[view] > 0 && column < model.columns[view].size(); ++column)
        EXPECT_LE(chosen, penalty(view, column) + 1e-6);
  }
}

TEST_F(ShadingPlannedPairs, AreForeshortenedOnlyByTheDistanceOfPairs) {
  const weights::QueryBatch batch = randomBatch(model, 10, 1, random);
  const weights::ShadeOptions apart{.interpolation = weights::Interpolation::separate, .foreshortened = true},
      together{.interpolation = weights::Interpolation::kriging, .foreshortened = true};
  EXPECT_EQ(
      image::errorOf([&] { planShading(model, batch, apart); }),
      model.folder.string() +
          ": foreshortening on: found pairs of cameras and lights, expected photographs under all lights "
          "from all cameras, or --interpolation kriging");
  EXPECT_NO_THROW(planShading(model, batch, together));
}

} // namespace
} // namespace surflect::shading
