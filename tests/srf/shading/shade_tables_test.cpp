// Shading by tables (srf/reflectance): laws, and the reference.
#include "srf/shading/shade.h"

#include "srf/capture/photograph.h"
#include "srf/model/shared_surface.h"
#include "srf/weights/light_weights.h"
#include "tests/srf/shading/queries.h"
#include "tests/support/random.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <numbers>

namespace surflect::shading {
namespace {

using namespace studio;

// Compares shading by random tables with the reference: random shadow states, places that share the weights
// of a query, an environment, and both ways to answer what tables leave.
void expectTablesEqualTheReference(model::Model& model, std::mt19937& random, double bound = 3e-6) {
  giveTables(model, random);
  for (const auto otherwise : {weights::Interpolation::separate, weights::Interpolation::kriging}) {
    model.interpolation.otherwise = otherwise;
    weights::QueryBatch batch = randomBatch(model, 300, 2, random);
    batch.extrapolation = {weights::LightExtrapolation::fade, weights::LightExtrapolation::clamp};
    EXPECT_LT(errorOfShading(model, batch, {}), bound);
    std::uniform_real_distribution<float> state(0, 1);
    for (size_t i = 0; i < batch.towardsLight.size(); ++i) batch.reached.push_back(state(random));
    EXPECT_LT(errorOfShading(model, batch, {}), bound);
    for (uint32_t query = 0; query < batch.size(); ++query) {
      batch.firstPlace.push_back(static_cast<uint32_t>(batch.places.size()));
      for (size_t more = 0; more <= query % 3; ++more)
        batch.places.push_back(static_cast<uint32_t>((batch.surfels[query] + more) % model.cloud.size()));
    }
    batch.firstPlace.push_back(static_cast<uint32_t>(batch.places.size()));
    EXPECT_LT(errorOfShading(model, batch, {}), bound);
    const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
    addEnvironment(batch, lights, random);
    EXPECT_LT(errorOfShading(model, batch, {}), 2 * bound); // sums of more terms
    addEnvironment(batch, std::span(lights).first(1), random);
    EXPECT_LT(errorOfShading(model, batch, {}), 2 * bound);         // one target for both, or one for each
    weights::QueryBatch alone = randomBatch(model, 300, 0, random); // without lamps
    addEnvironment(alone, lights, random);
    EXPECT_LT(errorOfShading(model, alone, {}), std::max(2 * bound, 1.2e-5)); // 7.4e-6: sums that cancel
  }
}

class ShadeTables : public ProductQueries {};
TEST_F(ShadeTables, EqualTheReference) { expectTablesEqualTheReference(model, random); }

// Weights of captured lights are interpolated in a light table.
TEST_F(ShadeTables, UnderAnEnvironmentByALightTableNearlyEqualTheReference) {
  giveTables(model, random);
  const weights::LightTable table = *weights::lightTable(model, {}, weights::LightExtrapolation::fade);
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  weights::QueryBatch batch = randomBatch(model, 300, 1, random);
  addEnvironment(batch, lights, random);
  batch.environments[0].table = &table;
  EXPECT_LT(errorOfShading(model, batch, {}), 1e-2);
}

// Places beside the object: views that store background there are left out of photographs and tables alike.
TEST_F(ShadeTables, UnderAnEnvironmentPlacesOfBackgroundEqualTheReference) {
  giveTables(model, random);
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  weights::QueryBatch batch = randomBatch(model, 300, 0, random);
  addEnvironment(batch, lights, random);
  for (auto& p : model.cloud.p0) p = assume<Point3<AcquisitionSpace>>(Vec3<float>(1.3f * p.raw()));
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  shade(model, batch, {}, cache, stats);
  EXPECT_GT(stats.lost, 30u);
  EXPECT_LT(errorOfShading(model, batch, {}), 3.2e-6);
}

// Photographs of other shadow states are counted, and listed only if targets are asked for.
TEST_F(ShadeTables, UnmatchedShadowsAreListedWithTargetsAlone) {
  model.interpolation.kind = weights::Interpolation::kriging;
  weights::QueryBatch batch = randomBatch(model, 200, 2, random);
  batch.reached.assign(batch.towardsLight.size(), 0.f);
  const ShadingPlan plan = planShading(model, batch, {}),
                    listed = planShading(model, batch, {.showsTargets = true});
  EXPECT_GT(plan.unmatchedShadows, 0u);
  EXPECT_TRUE(plan.unmatchedAt.empty());
  EXPECT_EQ(listed.unmatchedAt.size(), plan.unmatchedShadows);
}

TEST_F(ShadeTables, UnderColouredPointLightsEqualTheReference) {
  for (size_t light = 0; light < model.rig.lights.size(); ++light) {
    const auto place = assume<Point3<AcquisitionSpace, double>>(5 * randomUnit(random));
    model.rig.lights[light].kind =
        capture::PointLight{place, {static_cast<float>(25 + 25 * (light % 3)), 50, 12}};
  }
  expectTablesEqualTheReference(model, random,
                                7e-5); // by the root of cosines near 0 (tableLink), for irradiance up to 4
}

class ShadeTablesWithGaps : public PairQueries {};
TEST_F(ShadeTablesWithGaps, EqualTheReference) { expectTablesEqualTheReference(model, random); }

class ShadeTablesWithFewGaps : public NearPairQueries {};
TEST_F(ShadeTablesWithFewGaps, EqualTheReference) { expectTablesEqualTheReference(model, random); }

// Groups of four random queries with three places each, whose weights are random.
weights::QueryBatch randomGroups(const model::Model& model, size_t groups, std::mt19937& random) {
  std::uniform_real_distribution<float> any(0, 1);
  weights::QueryBatch batch = randomBatch(model, 4 * groups, 2, random);
  const weights::QueryBatch places = randomBatch(model, 3 * groups, 2, random);
  batch.places = places.surfels;
  for (uint32_t group = 0; group <= groups; ++group) batch.firstPlace.push_back(3 * group);
  for (size_t place = 0; place < batch.places.size(); ++place) {
    weights::AtCorners<float> own;
    for (float& weight : own) weight = any(random);
    const float sum = own[0] + own[1] + own[2] + own[3];
    for (float& weight : own) weight /= sum;
    batch.cornerWeights.push_back(own);
  }
  return batch;
}

// A query of a batch of groups, whose only place is one of the batch.
weights::QueryBatch cornerOf(const weights::QueryBatch& batch, size_t query, uint32_t place) {
  weights::QueryBatch one;
  one.lights = batch.lights;
  one.surfels = {batch.surfels[query]};
  one.places = {place};
  one.firstPlace = {0, 1};
  one.towardsView = {batch.towardsView[query]};
  for (size_t l = query * batch.lights; l < (query + 1) * batch.lights; ++l) {
    one.towardsLight.push_back(batch.towardsLight[l]);
    one.irradiance.push_back(batch.irradiance[l]);
  }
  return one;
}

TEST_F(ShadeTables, UnderKrigingAPlaceIsTheMeanOfWhatItsCornersSay) {
  model.interpolation.kind = weights::Interpolation::kriging;
  std::ranges::fill(model.visibility.values, uint8_t{255}); // each place is seen by its corners' views
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  const weights::QueryBatch batch = randomGroups(model, 40, random);
  const std::vector<Rgb> got = shade(model, batch, {}, cache, stats).radiance;
  ASSERT_EQ(got.size(), batch.places.size());
  for (size_t place = 0; place < got.size(); ++place) {
    Rgb wanted;
    for (size_t corner = 0; corner < 4; ++corner) {
      const auto own = cornerOf(batch, 4 * (place / 3) + corner, batch.places[place]);
      wanted = wanted + batch.cornerWeights[place][corner] * shade(model, own, {}, cache, stats).radiance[0];
    }
    EXPECT_NEAR(got[place].r, wanted.r, 1e-5 * model.white);
    EXPECT_NEAR(got[place].b, wanted.b, 1e-5 * model.white);
  }
}

// Something else may hide a place in a view that sees its corners.
TEST_F(ShadeTables, APlaceIsNotLookedUpWhereItIsHiddenIfAnotherViewShowsIt) {
  model.interpolation.kind = weights::Interpolation::kriging;
  const weights::QueryBatch batch = randomGroups(model, 40, random);
  for (const uint32_t place : batch.places)
    for (size_t view = 0; view < model.rig.views.size(); view += 2)
      model.visibility.values[place * model.rig.views.size() + view] = 0;
  const ShadingPlan plan = planShading(model, batch, {});
  std::vector<size_t> seen(plan.targets()), hidden(plan.targets());
  std::vector<double> sums(plan.targets());
  for (const ShadingOp& op : plan.ops) {
    const bool isSeen = model.visibility.of(batch.places[op.target / plan.targetsPerPlace])[op.view] > 0;
    ++(isSeen ? seen : hidden)[op.target];
    sums[op.target] += op.weight;
  }
  size_t bothCounted = 0, chosen = 0;
  for (size_t target = 0; target < plan.targets(); ++target) {
    bothCounted += seen[target] > 0 && hidden[target] > 0;
    chosen += seen[target] > 0;
    if (plan.ops.empty() || seen[target] + hidden[target] == 0) continue;
    EXPECT_NEAR(sums[target], 1, 1e-4);
  }
  EXPECT_EQ(bothCounted, 0u);
  EXPECT_GT(chosen, plan.targets() / 4);
}

// A surfel that is its own corner, whatever the other corners are.
TEST_F(ShadeTables, ACornerOfAPatchIsAnsweredAsWithoutOne) {
  giveTables(model, random);
  model.interpolation.otherwise = weights::Interpolation::kriging;
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  weights::QueryBatch batch = randomBatch(model, 120, 2, random);
  const std::vector<Rgb> wanted = shade(model, batch, {}, cache, stats).radiance;
  batch.places = batch.surfels;
  for (uint32_t place = 0; place <= batch.size(); place += 4) batch.firstPlace.push_back(place);
  for (size_t place = 0; place < batch.size(); ++place) {
    batch.cornerWeights.push_back({});
    batch.cornerWeights.back()[place % 4] = 1;
  }
  const std::vector<Rgb> got = shade(model, batch, {}, cache, stats).radiance;
  for (size_t place = 0; place < got.size(); ++place) {
    EXPECT_NEAR(got[place].r, wanted[place].r, 1e-5 * model.white);
    EXPECT_NEAR(got[place].b, wanted[place].b, 1e-5 * model.white);
  }
}

// Tables that pack has fitted to a glossy sphere.
class ShadeFittedTables : public TableQueries {
protected:
  ShadeFittedTables() {
    shared.interpolation = weights::Interpolation::shared;
    model.shared->trust.assign(model.shared->trust.size(), 1.f);
  }
  std::vector<Rgb> shaded(const weights::QueryBatch& batch) {
    return shade(model, batch, shared, cache, stats).radiance;
  }

  weights::ShadeOptions shared;
  codec::BlockCache cache{model.files, size_t{1} << 28};
  ShadingStats stats;
};

// Epipole consistency: the pixel of the photograph itself.
TEST_F(ShadeFittedTables, GiveBackThePhotographOfACapturedRay) {
  auto [batch, photographs] = capturedRays(model, random);
  for (uint32_t query = 0; query < batch.size(); ++query)
    batch.reached.push_back(weights::VisibilityWeights::decode(
        model.lightVisibility->of(batch.surfels[query])[photographs[query].second]));
  const std::vector<Rgb> got = shaded(batch);
  ShadingPlan plan;
  plan.places = batch.size();
  for (uint32_t column = 0; column < model.rig.lights.size(); ++column) plan.rows.add(column, {1, 1, 1});
  for (uint32_t query = 0; query < batch.size(); ++query) {
    const auto [view, column] = photographs[query];
    const auto pixel =
        *model.rig.views[view].camera.project(model.cloud.p0[batch.surfels[query]].cast<double>());
    plan.ops.push_back(
        {query, view, static_cast<float>(pixel.x), static_cast<float>(pixel.y), 1, column, column + 1});
  }
  const std::vector<Rgb> wanted = shade(plan, cache, stats);
  for (size_t query = 0; query < batch.size(); ++query) {
    const auto tolerance = static_cast<float>(2e-3 * (model.white + wanted[query].g));
    EXPECT_NEAR(got[query].r, wanted[query].r, tolerance);
    EXPECT_NEAR(got[query].g, wanted[query].g, tolerance);
    EXPECT_NEAR(got[query].b, wanted[query].b, tolerance);
  }
}

// Largest change of radiance from one step to the next, of each path; paths follow each other, of steps + 1
// places.
std::vector<double> largestSteps(std::span<const Rgb> radiance, size_t paths, size_t steps) {
  std::vector<double> largest(paths, 0);
  for (size_t path = 0; path < paths; ++path)
    for (size_t step = 0; step < steps; ++step) {
      const size_t i = path * (steps + 1) + step;
      largest[path] = std::max(largest[path], std::abs(double{radiance[i + 1].g} - radiance[i].g));
    }
  return largest;
}

// The largest step along each of 1,000 paths of viewer, light and shadow state falls below 0.6 of itself when
// there are four times as many steps, but for rounding.
TEST_F(ShadeFittedTables, AnswerContinuously) {
  constexpr uint32_t kPaths = 1000;
  const weights::QueryBatch ends = randomBatch(model, 2 * kPaths, 1, random);
  const auto between = [](const auto& a, const auto& b, float t) {
    const Vec3<float> mixed = (1 - t) * a.raw() + t * b.raw() + 0.01f * a.raw().unitOrthogonal();
    return assume<Direction3<AcquisitionSpace>>(mixed.normalized());
  };
  const auto stepsOf = [&](uint32_t steps) {
    weights::QueryBatch batch;
    batch.lights = 1;
    for (uint32_t path = 0; path < kPaths; ++path)
      for (uint32_t step = 0; step <= steps; ++step) {
        const float t = 0.1f * static_cast<float>(step) / static_cast<float>(steps); // a tenth of the way
        batch.surfels.push_back(ends.surfels[path]);
        batch.towardsView.push_back(between(ends.towardsView[path], ends.towardsView[path + kPaths], t));
        batch.towardsLight.push_back(between(ends.towardsLight[path], ends.towardsLight[path + kPaths], t));
        batch.irradiance.push_back({1, 1, 1});
        batch.reached.push_back(0.4f + 4 * t);
      }
    const std::vector<Rgb> radiance = shaded(batch);
    return largestSteps(radiance, kPaths, steps);
  };
  const std::vector<double> coarse = stepsOf(32), fine = stepsOf(128);
  for (size_t path = 0; path < kPaths; ++path) EXPECT_LT(fine[path], 0.6 * coarse[path] + 1e-3 * model.white);
}

// Likewise while a map of a few lights turns about z by a tenth of a turn.
TEST_F(ShadeFittedTables, AnswerAMapThatTurnsContinuously) {
  constexpr uint32_t kPaths = 300;
  const weights::QueryBatch ends = randomBatch(model, kPaths, 0, random);
  const std::vector<weights::EnvironmentLight> lights{
      {{0.6f, 0, 0.8f}, {1, 1, 1}}, {{0, 1, 0}, {1, 1, 1}}, {{-0.8f, 0, -0.6f}, {1, 1, 1}}};
  const weights::LightTable table = *weights::lightTable(model, shared, weights::LightExtrapolation::fade);
  for (const weights::LightTable* tabulated : {&table, static_cast<const weights::LightTable*>(nullptr)}) {
    const auto stepsOf = [&](uint32_t steps) {
      weights::QueryBatch batch;
      batch.environments.push_back({lights, {1, 1, 1}, weights::LightExtrapolation::fade, tabulated});
      for (uint32_t path = 0; path < kPaths; ++path)
        for (uint32_t step = 0; step <= steps; ++step) {
          batch.surfels.push_back(ends.surfels[path]);
          batch.towardsView.push_back(ends.towardsView[path]);
          const float angle =
              0.2f * std::numbers::pi_v<float> * static_cast<float>(step) / static_cast<float>(steps);
          const Mat3<float> turn =
              Eigen::AngleAxisf(angle + static_cast<float>(path), Vec3<float>::UnitZ()).toRotationMatrix();
          batch.acquisitionFromEnvironment.emplace_back(turn);
        }
      const std::vector<Rgb> radiance = shaded(batch);
      return largestSteps(radiance, kPaths, steps);
    };
    const std::vector<double> coarse = stepsOf(64), fine = stepsOf(256);
    for (size_t path = 0; path < kPaths; ++path)
      EXPECT_LT(fine[path], 0.6 * coarse[path] + 1e-3 * model.white);
  }
}

// A window around z, of 12 degrees about its middle, in a dim room. Kriging blends photographs for it, which
// show the highlights of their own lights.
TEST_F(ShadeFittedTables, PutTheHighlightsOfAnEnvironmentWhereTheyBelong) {
  std::vector<weights::EnvironmentLight> window;
  for (const Vec3<double>& towards : spiral(400)) {
    const float irradiance = towards.z() > 0.978 ? 0.15f : 0.0015f;
    window.push_back(
        {assume<Direction3<EnvironmentSpace>>(towards.cast<float>()), {irradiance, irradiance, irradiance}});
  }
  weights::QueryBatch batch = randomBatch(model, 300, 0, random);
  for (size_t query = 0; query < batch.size(); ++query) {
    const auto n = model.cloud.p0[batch.surfels[query]].raw();
    while (batch.towardsView[query].raw().dot(n) < 0.4f) batch.towardsView[query] = randomDirection(random);
  }
  addEnvironment(batch, window, random);
  const weights::LightTable table = *weights::lightTable(model, shared, weights::LightExtrapolation::fade);
  const auto errorWith = [&](weights::Interpolation interpolation, const weights::LightTable* tabulated) {
    weights::ShadeOptions options;
    options.interpolation = interpolation;
    batch.environments[0].table = tabulated;
    const std::vector<Rgb> got = shade(model, batch, options, cache, stats).radiance;
    double sum = 0;
    for (size_t query = 0; query < batch.size(); ++query) {
      const Vec3<float> n = model.cloud.p0[batch.surfels[query]].raw().normalized();
      float truth = 0;
      for (const auto& [towards, irradiance, spread] : window) {
        const Vec3<float> light = batch.rotationOf(query, 0)(towards).raw();
        truth += (lambert(Studio{}.albedo, irradiance, n, light) +
                  highlight(irradiance, n, light, batch.towardsView[query].raw()))
                     .g; // strength 1
      }
      sum += std::pow(double{got[query].g} - truth, 2);
    }
    return std::sqrt(sum / static_cast<double>(batch.size()));
  };
  const double before = errorWith(weights::Interpolation::kriging, &table);
  const double tabulated = errorWith(weights::Interpolation::shared, &table),
               plain = errorWith(weights::Interpolation::shared, nullptr);
  EXPECT_LT(tabulated, 0.37 * before); // 0.19
  EXPECT_LT(plain, 0.37 * before);
}

// Nothing sparkles: no answer is more than twice as bright as the brightest photograph of the object.
TEST_F(ShadeFittedTables, AreNotBrighterThanPhotographs) {
  const auto [captured, photographs] = capturedRays(model, random);
  const auto brightest = [&](const weights::QueryBatch& batch) {
    float most = 0;
    const std::vector<Rgb> radiance = shaded(batch);
    for (size_t query = 0; query < batch.size(); ++query)
      most = std::max(most, radiance[query].g / batch.irradiance[query].g);
    return most;
  };
  EXPECT_LT(brightest(randomBatch(model, 30000, 1, random)), 2 * brightest(captured));
}

TEST_F(ShadeFittedTables, HaveTheSameBitsForAnyNumberOfThreads) {
  weights::QueryBatch batch = randomBatch(model, 3000, 2, random);
  const std::vector<weights::EnvironmentLight> lights{{{0, 0, 1}, {1, 2, 3}}, {{0, 1, 0}, {2, 1, 0.5f}}};
  addEnvironment(batch, lights, random);
  addEnvironment(batch, lights, random);
  const weights::LightTable table = *weights::lightTable(model, shared, weights::LightExtrapolation::fade);
  batch.environments[1].table = &table;
  const std::vector<Rgb> many = shaded(batch);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  codec::BlockCache small(model.files, 0);
  EXPECT_EQ(shade(model, batch, shared, small, stats).radiance, many);
}

// Under white light from all around, a matte surface is as bright as its albedo.
TEST(ShadeFurnace, TablesOfAMatteSurfaceKeepItsAlbedo) {
  constexpr float kFacing = 0.6f;
  const Studio studio{.cameras = 20, .lights = 12};
  const PackedStudio packed(studio, 1500);
  model::Model model = model::openModel(packed.folder / "model");
  model.shared = model::spreadOver(model, model::shareSample(model)); // pack trusts photographs alone
  std::mt19937 random(6);
  const std::vector<Vec3<double>> lights = spiral(400);
  weights::QueryBatch batch = randomBatch(model, 300, 0, random);
  for (size_t query = 0; query < batch.size(); ++query) {
    const auto n = model.cloud.p0[batch.surfels[query]].raw();
    while (batch.towardsView[query].raw().dot(n) < kFacing)
      batch.towardsView[query] = randomDirection(random);
    for (const Vec3<double>& towards : lights) {
      batch.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(towards.cast<float>()));
      const auto share = static_cast<float>(4 * std::numbers::pi / static_cast<double>(lights.size()));
      batch.irradiance.push_back({share, share, share});
    }
  }
  batch.lights = lights.size();
  weights::ShadeOptions shared;
  shared.interpolation = weights::Interpolation::shared;
  codec::BlockCache cache(model.files, everything);
  ShadingStats stats;
  double worst = 0;
  Vec3<double> sum = Vec3<double>::Zero();
  for (const auto& [r, g, b] : shade(model, batch, shared, cache, stats).radiance) {
    const Vec3<double> relative(r / studio.albedo.r, g / studio.albedo.g, b / studio.albedo.b);
    sum += relative;
    worst = std::max(worst, (relative.array() - 1).abs().maxCoeff());
  }
  for (const double mean : Vec3<double>(sum / static_cast<double>(batch.size()))) EXPECT_NEAR(mean, 1, 3e-3);
  EXPECT_LT(worst, 0.06);

  // The same light as an environment.
  std::vector<weights::EnvironmentLight> white;
  const auto share = static_cast<float>(4 * std::numbers::pi / static_cast<double>(lights.size()));
  for (const Vec3<double>& towards : lights)
    white.push_back({assume<Direction3<EnvironmentSpace>>(towards.cast<float>()), {share, share, share}});
  batch.lights = 0;
  batch.towardsLight.clear();
  batch.irradiance.clear();
  addEnvironment(batch, white, random);
  batch.environments[0].strength = {1, 1, 1};
  Rgb mean;
  for (const Rgb& radiance : shade(model, batch, shared, cache, stats).radiance)
    mean = mean + 1 / static_cast<float>(batch.size()) * radiance;
  EXPECT_NEAR(mean.r / studio.albedo.r, 1, 1e-2);
  EXPECT_NEAR(mean.g / studio.albedo.g, 1, 1e-2);
  EXPECT_NEAR(mean.b / studio.albedo.b, 1, 1e-2);
}

} // namespace
} // namespace surflect::shading
