#include "srf/model/shade.h"

#include "srf/capture/photograph.h"
#include "srf/query/foreshortening.h"
#include "srf/query/ulr.h"
#include "tests/support/synthetic_capture.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <numeric>

namespace surflect {
namespace {

using studio::gappyStudio;
using studio::PackedStudio;
using studio::Studio;

Direction3<AcquisitionSpace, double> towardsViewer(const View& view,
                                                   const Point3<AcquisitionSpace, double>& p0) {
  return Viewpoint(view.camera).towards(p0);
}

constexpr size_t everything = size_t{1} << 30; // bytes of cache

Direction3<AcquisitionSpace> randomDirection(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return assume<Direction3<AcquisitionSpace>>(Vec3<double>(x, y, z).normalized());
}

// Random surfels, viewers, lights and strengths. Viewers stand outside the surface.
QueryBatch randomBatch(const Model& model, size_t queries, size_t lights, std::mt19937& random) {
  std::uniform_real_distribution<float> strength(0.1f, 2);
  QueryBatch batch;
  batch.lights = lights;
  for (size_t q = 0; q < queries; ++q) {
    const auto surfel = static_cast<uint32_t>(random() % model.cloud.size());
    batch.surfels.push_back(surfel);
    const auto towards = randomDirection(random);
    const bool outside = towards.raw().dot(model.cloud.p0[surfel].raw()) > 0;
    batch.towardsView.push_back(outside ? towards : -towards);
    for (size_t l = 0; l < lights; ++l) {
      batch.towardsLight.push_back(randomDirection(random));
      const float r = strength(random), g = strength(random), b = strength(random);
      batch.irradiance.push_back({r, g, b});
    }
  }
  return batch;
}

QueryBatch permuted(const QueryBatch& batch, std::span<const size_t> order) {
  QueryBatch result;
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

std::vector<Rgb> shaded(const Model& model, const QueryBatch& batch, size_t cacheBytes = everything) {
  BlockCache cache(model.files, cacheBytes);
  ShadingStats stats;
  return shade(model, batch, {}, cache, stats);
}

std::span<const LightWeight> rowOf(const ShadingPlan& plan, const ShadingOp& op) {
  return std::span(plan.rows).subspan(op.rowBegin, op.rowEnd - op.rowBegin);
}

Rgb capturedIrradiance(const Model& model, const ShadingOp& op, uint32_t column) {
  return irradianceAt(model.rig.lights[model.columns[op.view][column]],
                      model.cloud.p0[0].cast<double>()); // directional: the same everywhere
}

// A ray from each surfel to each camera that sees it whole, under a light of that camera.
struct CapturedRays {
  QueryBatch batch;
  std::vector<std::pair<uint32_t, uint32_t>> photographs; // view and column, per query
};

CapturedRays capturedRays(const Model& model, std::mt19937& random) {
  CapturedRays rays;
  QueryBatch& batch = rays.batch;
  batch.lights = 1;
  for (uint32_t surfel = 0; surfel < model.cloud.size(); ++surfel)
    for (uint32_t view = 0; view < model.rig.views.size(); ++view) {
      if (model.fades.of(surfel)[view] < 255) continue;
      const auto p0 = model.cloud.p0[surfel].cast<double>();
      const auto column = static_cast<uint32_t>(random() % model.columns[view].size());
      const Light& light = model.rig.lights[model.columns[view][column]];
      batch.surfels.push_back(surfel);
      batch.towardsView.push_back(towardsViewer(model.rig.views[view], p0).cast<float>());
      batch.towardsLight.push_back(towardsLight(light, p0).cast<float>());
      batch.irradiance.push_back(irradianceAt(light, p0));
      rays.photographs.emplace_back(view, column);
    }
  return rays;
}

// A studio is packed once for all tests of a suite; the model is each test's own.
class Shade : public testing::Test {
protected:
  static void SetUpTestSuite() { packed = std::make_unique<PackedStudio>(Studio{}, 2000); }
  static void TearDownTestSuite() { packed.reset(); }

  static inline std::unique_ptr<PackedStudio> packed;
  Model model = openModel(packed->model.folder);
  std::mt19937 random{1};
};

class ShadePairs : public testing::Test {
protected:
  static void SetUpTestSuite() { packed = std::make_unique<PackedStudio>(gappyStudio(), 1000); }
  static void TearDownTestSuite() { packed.reset(); }

  static inline std::unique_ptr<PackedStudio> packed;
  Model model = openModel(packed->model.folder);
  std::mt19937 random{2};
};

TEST_F(Shade, WeightsOfCamerasAndOfLightsSumToOne) {
  for (const size_t lights : {1, 3}) {
    const QueryBatch batch = randomBatch(model, 2000, lights, random);
    const ShadingPlan plan = planShading(model, batch, {.foreshortened = false});
    EXPECT_EQ(plan.unseen, 0u);
    std::vector<double> sums(batch.size());
    for (const ShadingOp& op : plan.ops) {
      EXPECT_GT(op.weight, 0);
      sums[op.target] += op.weight;
      double got = 0, wanted = 0; // irradiance: what the row gives back of the captured one
      for (const auto& [column, weight] : rowOf(plan, op))
        got += weight.g * capturedIrradiance(model, op, column).g;
      for (size_t l = 0; l < lights; ++l) wanted += batch.irradiance[op.target * lights + l].g;
      EXPECT_NEAR(got / wanted, 1, 3.5e-7);
    }
    for (const double sum : sums) EXPECT_NEAR(sum, 1, 2.7e-7);
  }
}

// Foreshortened, lights keep what falls on the surface, not what would fall on one that faces them.
TEST_F(Shade, ForeshortenedLightsKeepTheIrradianceOfTheSurface) {
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  const ShadingPlan plan = planShading(model, batch, {.foreshortened = true});
  size_t lit = 0;
  for (const ShadingOp& op : plan.ops) {
    const uint32_t surfel = batch.surfels[op.target];
    const auto normal = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(model.cloud.r0[surfel]).col(2));
    const float cosine = foreshortenedCosine(normal, batch.towardsLight[op.target]);
    double got = 0;
    for (const auto& [column, weight] : rowOf(plan, op)) {
      const Light& light = model.rig.lights[model.columns[op.view][column]];
      got += weight.g * capturedIrradiance(model, op, column).g *
             foreshortenedCosine(normal,
                                 towardsLight(light, model.cloud.p0[surfel].cast<double>()).cast<float>());
    }
    const double wanted = batch.irradiance[op.target].g * cosine;
    if (cosine > 0.5f) { // nearer to grazing the ratio may be bounded
      EXPECT_NEAR(got / wanted, 1, 2e-3);
      ++lit;
    }
    if (cosine == 0) {
      EXPECT_LT(got, 2e-3 * batch.irradiance[op.target].g);
    }
  }
  EXPECT_GT(lit, plan.ops.size() / 8);
}

TEST_F(Shade, OnlyCamerasThatSeeTheSurfelAreAsked) {
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  for (const ShadingOp& op : planShading(model, batch, {}).ops)
    EXPECT_GT(model.fades.of(batch.surfels[op.target])[op.view], 0);
}

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

  // And its radiance is that of the sphere, but for the bilinear look-up and the tolerance of the store.
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
  const QueryBatch batch = randomBatch(model, 1000, 2, random);
  const ShadingPlan plan = planShading(model, batch, {});
  BlockCache cache(model.files, everything);
  ShadingStats stats;
  const auto fast = execute(plan.ops, plan.rows, batch.size(), cache, stats);
  const auto exact = executeReference(plan.ops, plan.rows, batch.size(), cache);
  double worst = 0;
  for (size_t q = 0; q < batch.size(); ++q)
    worst = std::max({worst, std::abs(fast[q].r - exact[q][0]), std::abs(fast[q].g - exact[q][1]),
                      std::abs(fast[q].b - exact[q][2])});
  EXPECT_LT(worst / model.white, 2.7e-7);
}

TEST_F(Shade, SameBitsForAnyThreadsAndAnyCache) {
  const QueryBatch batch = randomBatch(model, 2000, 2, random);
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
  const QueryBatch batch = randomBatch(model, 2000, 2, random);
  std::vector<size_t> order(batch.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::shuffle(order, random);
  const auto direct = shaded(model, batch), shuffled = shaded(model, permuted(batch, order));
  for (size_t q = 0; q < order.size(); ++q) EXPECT_EQ(shuffled[q], direct[order[q]]);
}

TEST_F(Shade, LightAddsUp) {
  const QueryBatch both = randomBatch(model, 1000, 2, random);
  QueryBatch first = both, second = both;
  first.lights = second.lights = 1;
  for (QueryBatch* one : {&first, &second}) {
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
  QueryBatch batch = randomBatch(model, 500, 1, random);
  const auto lit = planShading(model, batch, {}).lightBlend;
  std::ranges::fill(batch.irradiance, Rgb{});
  EXPECT_EQ(planShading(model, batch, {}).lightBlend, lit);
  EXPECT_EQ(shaded(model, batch), std::vector<Rgb>(batch.size()));
}

TEST_F(Shade, WhereNoCameraSeesOthersStandIn) {
  const QueryBatch batch = randomBatch(model, 300, 1, random);
  std::ranges::fill(model.fades.values, uint8_t{0});
  const ShadingPlan plan = planShading(model, batch, {});
  EXPECT_EQ(plan.unseen, batch.size());
  std::vector<double> sums(batch.size());
  for (const ShadingOp& op : plan.ops) {
    EXPECT_GT(op.weight, 0);
    EXPECT_TRUE(contains(model.rig.views[op.view].camera.lens, {op.x, op.y}));
    sums[op.target] += op.weight;
  }
  for (const double sum : sums) EXPECT_NEAR(sum, 1, 2.7e-7);
}

TEST_F(Shade, AStandInHasNoWeightBesideACameraThatSees) {
  const QueryBatch batch = randomBatch(model, 2000, 1, random);
  for (size_t i = 0; i < model.cloud.size(); ++i) { // one sees each surfel; others may be nearer by far
    const auto row = std::span(model.fades.values).subspan(i * model.fades.views, model.fades.views);
    std::ranges::fill(row, uint8_t{0});
    row[i % model.fades.views] = 255;
  }
  const ShadingPlan plan = planShading(model, batch, {});
  EXPECT_EQ(plan.unseen, 0u);
  size_t within90Degrees = 0;
  for (const ShadingOp& op : plan.ops) {
    const uint32_t surfel = batch.surfels[op.target];
    const size_t seeing = surfel % model.fades.views;
    const auto towards = towardsViewer(model.rig.views[seeing], model.cloud.p0[surfel].cast<double>());
    if (anglePenalty(towards.cast<float>(), batch.towardsView[op.target]) > 1) continue;
    ++within90Degrees;
    EXPECT_EQ(op.view, seeing);
  }
  EXPECT_GT(within90Degrees, batch.size() / 4);
}

TEST_F(Shade, TheBaselineIsTheNearestCameraAndItsNearestLight) {
  const QueryBatch batch = randomBatch(model, 1000, 1, random);
  ShadeOptions nearest;
  nearest.nearest = true;
  const ShadingPlan plan = planShading(model, batch, nearest);
  ASSERT_EQ(plan.ops.size(), batch.size());
  for (const ShadingOp& op : plan.ops) {
    EXPECT_EQ(op.weight, 1);
    const auto p0 = model.cloud.p0[batch.surfels[op.target]].cast<double>();
    const auto fades = model.fades.of(batch.surfels[op.target]);
    const auto viewPenalty = [&](size_t view) {
      return anglePenalty(towardsViewer(model.rig.views[view], p0),
                          batch.towardsView[op.target].cast<double>());
    };
    for (size_t view = 0; view < fades.size(); ++view)
      EXPECT_TRUE(fades[view] == 0 || viewPenalty(op.view) <= viewPenalty(view) + 1e-6);
    ASSERT_EQ(rowOf(plan, op).size(), 1u);
    const auto lightPenalty = [&](const Light& light) {
      return anglePenalty(towardsLight(light, p0), batch.towardsLight[op.target].cast<double>());
    };
    const Light& chosen = model.rig.lights[rowOf(plan, op)[0].light];
    for (const Light& light : model.rig.lights) EXPECT_LE(lightPenalty(chosen), lightPenalty(light) + 1e-6);
  }
}

TEST_F(Shade, ALitCaptureNeedsALight) {
  const QueryBatch batch = randomBatch(model, 10, 0, random);
  EXPECT_NE(errorOf([&] { planShading(model, batch, {}); }).find("needs a light"), std::string::npos);
}

TEST_F(ShadePairs, WeightsOfThePairsOfEachLightSumToOne) {
  ASSERT_FALSE(model.isFullProduct);
  const QueryBatch batch = randomBatch(model, 1000, 2, random);
  const ShadingPlan plan = planShading(model, batch, {});
  ASSERT_EQ(plan.targetsPerQuery, 2u);
  std::vector<double> sums(2 * batch.size()), irradiance(2 * batch.size());
  for (const ShadingOp& op : plan.ops) {
    ASSERT_EQ(rowOf(plan, op).size(), 1u);
    const auto [column, weight] = rowOf(plan, op)[0];
    ASSERT_LT(column, model.columns[op.view].size());
    EXPECT_GT(model.fades.of(batch.surfels[op.target / 2])[op.view], 0);
    sums[op.target] += op.weight;
    irradiance[op.target] += op.weight * weight.r * capturedIrradiance(model, op, column).r;
  }
  for (size_t target = 0; target < sums.size(); ++target) {
    EXPECT_NEAR(sums[target], 1, 4.5e-7);
    EXPECT_NEAR(irradiance[target] / batch.irradiance[target].r, 1, 7e-7);
  }
}

// Even where operations are lost: what makes up for them is of the same light.
TEST_F(ShadePairs, LightsAddUp) {
  const QueryBatch both = randomBatch(model, 400, 2, random);
  ShadingPlan plan = planShading(model, both, {});
  for (size_t i = 0; i < plan.ops.size(); i += 7) plan.ops[i].x = plan.ops[i].y = 0.5f; // the empty corner
  ShadingStats stats;
  BlockCache cache(model.files, size_t{1} << 20);
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

TEST_F(ShadePairs, ACapturedPairHasAllTheWeight) {
  const auto [batch, photographs] = capturedRays(model, random);
  ASSERT_GT(batch.size(), 2000u);
  const ShadingPlan plan = planShading(model, batch, {});
  std::vector<double> weight(batch.size());
  for (const ShadingOp& op : plan.ops)
    if (std::pair(op.view, rowOf(plan, op)[0].light) == photographs[op.target]) weight[op.target] = op.weight;
  for (const double w : weight) EXPECT_NEAR(w, 1, 1e-7);
}

TEST_F(ShadePairs, TheBaselineIsTheNearestPair) {
  const QueryBatch batch = randomBatch(model, 500, 1, random);
  ShadeOptions nearest;
  nearest.nearest = true;
  const ShadingPlan plan = planShading(model, batch, nearest);
  ASSERT_EQ(plan.ops.size(), batch.size());
  for (const ShadingOp& op : plan.ops) {
    const auto p0 = model.cloud.p0[batch.surfels[op.target]].cast<double>();
    const auto fades = model.fades.of(batch.surfels[op.target]);
    const auto penalty = [&](size_t view, size_t column) {
      const Light& light = model.rig.lights[model.columns[view][column]];
      return anglePenalty(towardsViewer(model.rig.views[view], p0),
                          batch.towardsView[op.target].cast<double>()) +
             anglePenalty(towardsLight(light, p0), batch.towardsLight[op.target].cast<double>());
    };
    const double chosen = penalty(op.view, rowOf(plan, op)[0].light);
    for (size_t view = 0; view < fades.size(); ++view)
      for (size_t column = 0; fades[view] > 0 && column < model.columns[view].size(); ++column)
        EXPECT_LE(chosen, penalty(view, column) + 1e-6);
  }
}

TEST(ShadeFixedIllumination, ComesBackWithoutLightsAndRefusesThem) {
  const PackedStudio packed({.lights = 0}, 1000);
  std::mt19937 random(3);
  const QueryBatch batch = randomBatch(packed.model, 1000, 0, random);
  const auto radiance = shaded(packed.model, batch);
  double squares = 0;
  for (size_t q = 0; q < batch.size(); ++q) {
    const Rgb truth = studio::fixedRadiance(packed.model.cloud.p0[batch.surfels[q]].raw());
    squares += std::pow(radiance[q].r - truth.r, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(batch.size())) / packed.model.white, 0.011);

  const QueryBatch lit = randomBatch(packed.model, 10, 1, random);
  EXPECT_NE(errorOf([&] { planShading(packed.model, lit, {}); }).find("fixed illumination"),
            std::string::npos);
}

} // namespace
} // namespace surflect
