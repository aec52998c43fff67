#include "srf/shading/shade.h"

#include "srf/capture/photograph.h"
#include "srf/shading/reference.h"
#include "tests/srf/shading/queries.h"
#include "tests/support/random.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace surflect::shading {
namespace {

using namespace studio;

weights::QueryBatch permuted(const weights::QueryBatch& batch, std::span<const size_t> order) {
  weights::QueryBatch result;
  result.lights = batch.lights;
  for (const size_t q : order) {
    result.surfels.push_back(batch.surfels[q]);
    result.towardsView.push_back(batch.towardsView[q]);
    for (size_t entry = q * batch.lights; entry < (q + 1) * batch.lights; ++entry) {
      result.towardsLight.push_back(batch.towardsLight[entry]);
      result.irradiance.push_back(batch.irradiance[entry]);
    }
  }
  return result;
}

std::vector<Rgb> shaded(const model::Model& model, const weights::QueryBatch& batch,
                        size_t cacheBytes = everything) {
  codec::BlockCache cache(model.files, cacheBytes);
  ShadingStats stats;
  return shade(model, batch, {}, cache, stats).radiance;
}

class Shade : public ProductQueries {};
class ShadePairs : public PairQueries {};
class ShadeNearPairs : public NearPairQueries {};

// Foreshortened, a light keeps its irradiance on the surface rather than on a surface facing it.
TEST_F(Shade, ACapturedRayUnderACapturedLightIsThatPhotograph) {
  const auto [batch, photographs] = capturedRays(model, random);
  ASSERT_GT(batch.size(), 5000u);

  const ShadingPlan plan = planShading(model, batch, {});
  std::vector<bool> found(batch.size());
  for (const ShadingOp& op : plan.ops) {
    const auto [view, column] = photographs[op.target];
    if (op.view != view) continue;
    found[op.target] = true;
    EXPECT_NEAR(op.weight, 1, 1e-7);
    for (const auto& [other, weight] : rowOf(plan, op)) EXPECT_NEAR(weight.r, other == column, 1e-11);
  }
  EXPECT_EQ(std::ranges::count(found, true), std::ssize(found));

  // The radiance is that of the sphere, up to bilinear interpolation and the codec's tolerance.
  const auto radiance = shaded(model, batch);
  double squares = 0;
  for (size_t q = 0; q < batch.size(); ++q) {
    const Rgb truth = studio::lambert(Studio{}.albedo, batch.irradiance[q],
                                      model.cloud.p0[batch.surfels[q]].raw(), batch.towardsLight[q].raw());
    squares += std::pow(radiance[q].g - truth.g, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(batch.size())) / model.white, 0.0066);
}

TEST_F(Shade, TheQueueEqualsTheDoublePrecisionReference) {
  const weights::QueryBatch batch = randomBatch(model, 1000, 2, random);
  const ShadingPlan plan = planShading(model, batch, {});
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  const auto fast = execute(plan.ops, plan.rows, batch.size(), cache, stats);
  const auto exact = executeReference(plan.ops, plan.rows, batch.size(), cache);
  double worst = 0;
  for (size_t q = 0; q < batch.size(); ++q)
    worst = std::max({worst, std::abs(fast[q].r - exact[q][0]), std::abs(fast[q].g - exact[q][1]),
                      std::abs(fast[q].b - exact[q][2])});
  EXPECT_LT(worst / model.white, 2.7e-7);
}

// ULR weights are steep next to a captured camera or light, where rounded directions show.
TEST_F(Shade, EqualsTheReference) {
  weights::QueryBatch batch = randomBatch(model, 300, 2, random);
  batch.extrapolation = {weights::LightExtrapolation::fade, weights::LightExtrapolation::clamp};
  for (const bool foreshortened : {false, true})
    for (const weights::LightFit fit : {weights::LightFit::mean, weights::LightFit::plane})
      EXPECT_LT(errorOfShading(model, batch, {.lightFit = fit, .foreshortened = foreshortened}), 3e-7);
  EXPECT_LT(errorOfShading(model, batch, {.nearest = true}), 4e-7);
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  addEnvironment(batch, lights, random);
  EXPECT_LT(errorOfShading(model, batch, {.foreshortened = true}), 7e-7);
  // Many surfels need fallback views.
  for (uint8_t& fade : model.visibility.values) fade = random() % 8 == 0 ? 255 : 0;
  EXPECT_LT(errorOfShading(model, batch, {}), 7e-6);
}

// Squared distances of pairs are rounded (pair_weights.cpp); the error measured is 1.8e-5.
void expectPairsOfTheReference(model::Model& model, std::mt19937& random) {
  model.interpolation.halfScale = 0.2f;
  weights::QueryBatch batch = randomBatch(model, 300, 2, random);
  batch.extrapolation = {weights::LightExtrapolation::fade, weights::LightExtrapolation::clamp};
  const auto expectEqual = [&] {
    for (const bool foreshortened : {false, true}) {
      EXPECT_LT(
          errorOfShading(model, batch,
                         {.interpolation = weights::Interpolation::kriging, .foreshortened = foreshortened}),
          3e-5);
      EXPECT_LT(errorOfShading(model, batch,
                               {.interpolation = weights::Interpolation::kriging,
                                .reciprocal = true,
                                .foreshortened = foreshortened}),
                2e-4);
    }
  };
  expectEqual();
  model.lightVisibility = {model.rig.lights.size(), {}};
  model.lightVisibility->values.resize(model.cloud.size() * model.rig.lights.size());
  for (uint8_t& reached : model.lightVisibility->values) reached = random() % 3 == 0 ? 0 : 255;
  for (size_t entry = 0; entry < batch.towardsLight.size(); ++entry)
    batch.reached.push_back(static_cast<float>(random() % 3) / 2);
  expectEqual();
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  addEnvironment(batch, lights, random);
  expectEqual();
  // Many surfels need fallback views.
  for (uint8_t& fade : model.visibility.values) fade = random() % 8 == 0 ? 255 : 0;
  expectEqual();
}

TEST_F(Shade, PairsOfNearViewsAndLightsEqualTheReference) { expectPairsOfTheReference(model, random); }
TEST_F(ShadePairs, PairsOfNearViewsAndLightsEqualTheReference) { expectPairsOfTheReference(model, random); }
TEST_F(ShadeNearPairs, PairsOfNearViewsAndLightsEqualTheReference) {
  expectPairsOfTheReference(model, random);
}

// Epipole consistency, for cameras and lights together.
void expectPhotographsThemselves(const model::Model& model, std::mt19937& random) {
  const auto [batch, photographs] = capturedRays(model, random);
  const ShadingPlan plan =
      planShading(model, batch, {.interpolation = weights::Interpolation::kriging, .foreshortened = false});
  std::vector<float> ofPhotograph(batch.size());
  for (const ShadingOp& op : plan.ops) {
    const auto [view, column] = photographs[op.target];
    if (op.view != view) continue;
    const Rgb all = weights::irradianceRatio(batch.irradiance[op.target], batch.irradiance[op.target]);
    for (const auto& [other, weight] : rowOf(plan, op))
      if (other == column) ofPhotograph[op.target] += op.weight * weight.r / all.r;
  }
  EXPECT_GT(*std::ranges::min_element(ofPhotograph), 1 - 3e-3f);
}

TEST_F(Shade, ACapturedRayUnderACapturedLightIsThatPhotographByPairsToo) {
  expectPhotographsThemselves(model, random);
}
TEST_F(ShadeNearPairs, ACapturedRayUnderACapturedLightIsThatPhotograph) {
  expectPhotographsThemselves(model, random);
}

// Photographs in light answer for light, those in shadow for shadow. Others have a little weight where those
// of the requested state are far, so that none appears at once. Here every second light is in shadow.
TEST_F(Shade, OnlyPhotographsOfTheRequestedShadowStateAnswer) {
  weights::QueryBatch batch = randomBatch(model, 300, 1, random);
  model.lightVisibility = {model.rig.lights.size(), {}};
  for (size_t i = 0; i < model.cloud.size(); ++i)
    for (size_t light = 0; light < model.rig.lights.size(); ++light)
      model.lightVisibility->values.push_back(light % 2 == 0 ? 255 : 0);
  for (const float reached : {0.f, 1.f}) {
    batch.reached.assign(batch.size(), reached);
    const ShadingPlan plan =
        planShading(model, batch, {.interpolation = weights::Interpolation::kriging, .foreshortened = false});
    double wrong = 0, all = 0;
    for (const ShadingOp& op : plan.ops)
      for (const auto& [light, factor] : rowOf(plan, op)) {
        const double weight = op.weight * factor.r *
                              capturedIrradiance(model, op, light, batch.surfels[op.target]).r /
                              batch.irradiance[op.target].r;
        all += weight;
        if ((light % 2 == 0) != (reached == 1)) wrong += weight;
      }
    EXPECT_NEAR(all, static_cast<double>(batch.size()), 0.001);
    EXPECT_LT(wrong, 0.08 * all);
  }
}

TEST_F(ShadePairs, EqualsTheReference) {
  weights::QueryBatch batch = randomBatch(model, 200, 2, random);
  batch.extrapolation = {weights::LightExtrapolation::fade, weights::LightExtrapolation::clamp};
  EXPECT_LT(errorOfShading(model, batch, {}), 3e-7);
  EXPECT_LT(errorOfShading(model, batch, {.weightError = 0.1f}), 2e-6);
  EXPECT_LT(errorOfShading(model, batch, {.nearest = true}), 2e-7);
  for (uint8_t& fade : model.visibility.values) fade = random() % 8 == 0 ? 255 : 0;
  EXPECT_LT(errorOfShading(model, batch, {}), 2e-7);
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  addEnvironment(batch, lights, random);
  EXPECT_LT(errorOfShading(model, batch, {}), 3e-7);
}

// Gives each query up to `most` random places, the first none and the second the most.
void addPlaces(weights::QueryBatch& batch, const model::Model& model, uint32_t most, std::mt19937& random) {
  batch.firstPlace = {0};
  for (size_t q = 0; q < batch.size(); ++q) {
    for (size_t i = q < 2 ? most * q : random() % (most + 1); i > 0; --i)
      batch.places.push_back(static_cast<uint32_t>(random() % model.cloud.size()));
    batch.firstPlace.push_back(static_cast<uint32_t>(batch.places.size()));
  }
}

TEST_F(Shade, PlacesHaveTheWeightsOfTheirQuery) {
  weights::QueryBatch batch = randomBatch(model, 150, 2, random);
  addPlaces(batch, model, 20, random);
  EXPECT_LT(errorOfShading(model, batch, {.placesPerQuery = 20}), 1e-6);
}

TEST_F(ShadePairs, PlacesHaveTheWeightsOfTheirQuery) {
  weights::QueryBatch batch = randomBatch(model, 50, 2, random);
  addPlaces(batch, model, 5, random);
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  addEnvironment(batch, lights, random);
  EXPECT_LT(errorOfShading(model, batch, {.placesPerQuery = 5}), 1e-6);
}

TEST_F(Shade, APlaceOfItsOwnChangesNoBit) {
  weights::QueryBatch batch = randomBatch(model, 300, 2, random);
  const std::vector<Rgb> expected = shaded(model, batch);
  batch.places = batch.surfels;
  for (uint32_t q = 0; q <= batch.size(); ++q) batch.firstPlace.push_back(q);
  EXPECT_EQ(shaded(model, batch), expected);
}

TEST_F(Shade, TruncatedWeightsEqualTheReference) {
  weights::QueryBatch batch = randomBatch(model, 300, 2, random); // long rows
  weights::QueryBatch one = randomBatch(model, 300, 1, random);
  for (const float error : {0.05f, 0.3f}) {
    for (const weights::LightFit fit : {weights::LightFit::mean, weights::LightFit::plane}) {
      const weights::ShadeOptions options{.lights = 2, .lightFit = fit, .weightError = error};
      EXPECT_LT(errorOfShading(model, batch, options), 3e-6);
      EXPECT_LT(errorOfShading(model, one, options), 3e-6);
    }
  }
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  addEnvironment(batch, lights, random);
  EXPECT_LT(errorOfShading(model, batch, {.foreshortened = true, .weightError = 0.1f}), 3e-6);
  const auto operations = [&](float error) {
    return planShading(model, one, {.weightError = error}).ops.size();
  };
  EXPECT_LT(operations(0.1f), 0.95 * static_cast<double>(operations(0)));
}

TEST_F(Shade, SameBitsForAnyThreadsAndAnyCache) {
  const weights::QueryBatch batch = randomBatch(model, 2000, 2, random);
  const auto expected = shaded(model, batch);
  size_t imageBytes = 0;
  for (uint32_t block = 0; block < model.files[0].blockCount(); ++block)
    imageBytes += model.files[0].read(block).memory();
  for (const int threads : {1, 2})
    for (const size_t cacheBytes : {model.files[0].read(0).memory(), 3 * imageBytes, everything})
      tbb::task_arena(threads).execute(
          [&] { EXPECT_EQ(shaded(model, batch, cacheBytes), expected) << threads << ", " << cacheBytes; });
}

TEST_F(Shade, ShufflingTheQueriesShufflesTheAnswers) {
  const weights::QueryBatch batch = randomBatch(model, 2000, 2, random);
  std::vector<size_t> order(batch.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::shuffle(order, random);
  const auto direct = shaded(model, batch), shuffled = shaded(model, permuted(batch, order));
  for (size_t q = 0; q < order.size(); ++q) EXPECT_EQ(shuffled[q], direct[order[q]]);
}

// Parts of any size give the result of the whole, also if the parts are generated one by one.
void expectPartsAreTheWhole(const model::Model& model, const weights::QueryBatch& batch) {
  const auto inPartsOf = [&](size_t targets) {
    codec::BlockCache cache(model.files, everything);
    ShadingStats stats;
    return shade(model, batch, {.showsBlends = true, .targetsAtOnce = targets}, cache, stats);
  };
  const auto filledFor = [&](size_t targets) {
    codec::BlockCache cache(model.files, everything);
    ShadingStats stats;
    size_t most = 0;
    const FillBatch fill = [&](size_t begin, size_t end, weights::QueryBatch& part) {
      most = std::max(most, end - begin);
      std::vector<size_t> queries(end - begin);
      std::iota(queries.begin(), queries.end(), begin);
      part = permuted(batch, queries);
    };
    const weights::ShadeOptions options{.showsBlends = true, .targetsAtOnce = targets};
    const Shaded filled = shade(model, batch.size(), fill, options, cache, stats);
    const size_t perQuery = model.isFullProduct ? 1 : batch.sources();
    EXPECT_EQ(most, std::min(batch.size(), std::max(size_t{1}, targets / perQuery / 4) * 4)); // whole groups
    return filled;
  };
  const Shaded whole = inPartsOf(std::numeric_limits<size_t>::max());
  ASSERT_EQ(whole.radiance.size(), batch.size());
  ASSERT_EQ(whole.confidence.size(), batch.size());
  for (const size_t targets : {1, 7, 600})
    for (const Shaded& parts : {inPartsOf(targets), filledFor(targets)}) {
      EXPECT_EQ(parts.radiance, whole.radiance) << targets;
      EXPECT_EQ(parts.confidence, whole.confidence) << targets;
      EXPECT_EQ(parts.cameraBlend, whole.cameraBlend) << targets;
      EXPECT_EQ(parts.lightBlend, whole.lightBlend) << targets;
      EXPECT_EQ(parts.unseen, whole.unseen) << targets;
    }
}

TEST_F(Shade, PartsAreTheWhole) { expectPartsAreTheWhole(model, randomBatch(model, 2000, 3, random)); }

TEST_F(ShadePairs, PartsAreTheWhole) { expectPartsAreTheWhole(model, randomBatch(model, 300, 3, random)); }

TEST_F(Shade, ManyLightsLeaveFewQueriesInMemory) {
  constexpr size_t kLights = 1 << 20, kQueries = 10;
  size_t most = 0;
  const FillBatch fill = [&](size_t begin, size_t end, weights::QueryBatch& batch) {
    most = std::max(most, end - begin);
    batch = randomBatch(model, end - begin, 1, random);
    batch.lights = kLights;
    batch.towardsLight.resize((end - begin) * kLights, Direction3<AcquisitionSpace>(0, 0, 1));
    batch.irradiance.resize((end - begin) * kLights, Rgb{0, 0, 0});
  };
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  EXPECT_THROW(shade(model, kQueries, fill, {}, cache, stats, {{}, [&] { return most > 0; }}), Cancelled);
  EXPECT_LE(most * kLights, size_t{1} << 22);
}

TEST_F(Shade, LapsAreSharedByPlanningAndLookUps) {
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  const auto sharesOf = [&](size_t queries) {
    std::vector<double> shares;
    const Shaded all = shade(model, randomBatch(model, queries, 1, random), {.targetsAtOnce = 700}, cache,
                             stats, {}, [&](double planning) { shares.push_back(planning); });
    EXPECT_EQ(all.radiance.size(), queries);
    return shares;
  };
  const std::vector<double> shares = sharesOf(1000);
  ASSERT_EQ(shares.size(), 4u); // two stages, each twice: resident blocks, then the rest
  for (const size_t lap : {0, 2}) EXPECT_TRUE(shares[lap] > 0 && shares[lap] < 1) << shares[lap];
  for (const size_t lap : {1, 3}) EXPECT_EQ(shares[lap], 0);
  EXPECT_EQ(sharesOf(0), (std::vector<double>{1, 0}));
}

TEST_F(Shade, LightAddsUp) {
  const weights::QueryBatch both = randomBatch(model, 1000, 2, random);
  weights::QueryBatch first = both, second = both;
  first.lights = second.lights = 1;
  for (weights::QueryBatch* one : {&first, &second}) {
    const size_t l = one == &second;
    one->towardsLight.clear();
    one->irradiance.clear();
    for (size_t q = 0; q < both.size(); ++q) {
      one->towardsLight.push_back(both.towardsLight[2 * q + l]);
      one->irradiance.push_back(both.irradiance[2 * q + l]);
    }
  }
  const auto sum = shaded(model, both), a = shaded(model, first), b = shaded(model, second);
  for (size_t q = 0; q < sum.size(); ++q) EXPECT_NEAR(sum[q].r, a[q].r + b[q].r, 2.4e-7);
}

TEST_F(Shade, ADarkLightIsBlackAndBlendsAsAnyOther) {
  weights::QueryBatch batch = randomBatch(model, 500, 1, random);
  const auto lit = planShading(model, batch, {.showsBlends = true}).lightBlend;
  std::ranges::fill(batch.irradiance, Rgb{});
  EXPECT_EQ(planShading(model, batch, {.showsBlends = true}).lightBlend, lit);
  EXPECT_EQ(shaded(model, batch), std::vector<Rgb>(batch.size()));
}

// Holds even if operations are lost, since they are compensated by operations of the same light.
TEST_F(ShadePairs, LightsAddUp) {
  const weights::QueryBatch both = randomBatch(model, 400, 2, random);
  ShadingPlan plan = planShading(model, both, {});
  // Moves every seventh operation to a corner without object.
  for (size_t i = 0; i < plan.ops.size(); i += 7) plan.ops[i].x = plan.ops[i].y = 0.5f;
  ShadingStats stats;
  codec::BlockCache cache(model.files, size_t{1} << 20);
  const auto together = shade(plan, cache, stats);
  EXPECT_GT(stats.lost, 0u);
  std::vector<Rgb> sum(both.size());
  for (uint32_t light = 0; light < 2; ++light) {
    ShadingPlan alone = plan;
    std::erase_if(alone.ops, [&](const ShadingOp& op) { return op.target % 2 != light; });
    const auto part = shade(alone, cache, stats);
    for (size_t q = 0; q < sum.size(); ++q) sum[q] = sum[q] + part[q];
  }
  for (size_t q = 0; q < sum.size(); ++q) {
    EXPECT_EQ(sum[q].r, together[q].r);
    EXPECT_EQ(sum[q].b, together[q].b);
  }
}

TEST(ShadeFixedIllumination, ComesBackWithoutLightsAndRefusesThem) {
  const PackedStudio packed({.lights = 0}, 1000);
  std::mt19937 random(3);
  const weights::QueryBatch batch = randomBatch(packed.model, 1000, 0, random);
  EXPECT_LT(errorOfShading(packed.model, batch, {}), 4e-7);
  const auto radiance = shaded(packed.model, batch);
  double squares = 0;
  for (size_t q = 0; q < batch.size(); ++q) {
    const Rgb truth = studio::fixedRadiance(packed.model.cloud.p0[batch.surfels[q]].raw());
    squares += std::pow(radiance[q].r - truth.r, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(batch.size())) / packed.model.white, 0.011);

  const weights::QueryBatch lit = randomBatch(packed.model, 10, 1, random);
  EXPECT_NE(image::errorOf([&] { planShading(packed.model, lit, {}); }).find("fixed illumination"),
            std::string::npos);
}

} // namespace
} // namespace surflect::shading
