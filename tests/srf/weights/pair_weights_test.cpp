#include "srf/weights/pair_weights.h"

#include "srf/shading/shade.h"
#include "srf/weights/irradiance_ratio.h"
#include "tests/srf/shading/queries.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace surflect::weights {
namespace {

using namespace studio;
using namespace shading;

// Scales as for an object with highlights.
class PairWeight : public ProductQueries {
protected:
  PairWeight() { model.interpolation.halfScale = 0.2f; }
};

constexpr ShadeOptions kReciprocal{
    .interpolation = Interpolation::kriging, .reciprocal = true, .foreshortened = true};

Normal3<AcquisitionSpace> normalOf(const model::Model& model, uint32_t surfel) {
  return assume<Normal3<AcquisitionSpace>>(Vec3<float>(rotationOf<float>(model.cloud.r0[surfel]).col(2)));
}

// Shares of photographs in the radiance of a query; by view, then light.
std::vector<double> sharesOf(const model::Model& model, const QueryBatch& batch, const ShadingPlan& plan,
                             uint32_t query) {
  std::vector<double> shares(model.rig.views.size() * model.rig.lights.size());
  for (const ShadingOp& op : plan.ops) {
    if (op.target != query) continue;
    for (const auto& [light, factor] : rowOf(plan, op))
      shares[op.view * model.rig.lights.size() + light] +=
          op.weight * factor.r * capturedIrradiance(model, op, light, batch.surfels[query]).r /
          batch.irradiance[query].r;
  }
  return shares;
}

void addQuery(QueryBatch& batch, uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView,
              const Direction3<AcquisitionSpace>& towardsLight) {
  batch.surfels.push_back(surfel);
  batch.towardsView.push_back(towardsView);
  batch.towardsLight.push_back(towardsLight);
  batch.irradiance.push_back({1, 1, 1});
}

// Helmholtz reciprocity: the viewer is at a light, and the light at a camera.
TEST_F(PairWeight, APhotographAnswersForCameraAndLightExchanged) {
  QueryBatch batch;
  batch.lights = 1;
  std::vector<size_t> photographs;
  for (uint32_t surfel = 0; surfel < model.cloud.size(); surfel += 7)
    for (uint32_t view = 0; view < model.rig.views.size(); ++view) {
      const auto light = static_cast<uint32_t>(random() % model.rig.lights.size());
      const auto p0 = model.cloud.p0[surfel].cast<double>();
      const auto towardsLight = capture::towardsLight(model.rig.lights[light], p0).cast<float>();
      if (model.visibility.of(surfel)[view] < 255 ||
          foreshortenedCosine(normalOf(model, surfel), towardsLight) < 0.35f)
        continue;
      addQuery(batch, surfel, towardsLight, towardsViewer(model.rig.views[view], p0).cast<float>());
      photographs.push_back(view * model.rig.lights.size() + light);
    }
  ASSERT_GT(batch.size(), 200u);
  const ShadingPlan plan = planShading(model, batch, kReciprocal);
  size_t answered = 0;
  for (uint32_t query = 0; query < batch.size(); ++query) {
    const auto shares = sharesOf(model, batch, plan, query);
    double all = 0;
    for (const double share : shares) all += share;
    if (shares[photographs[query]] > 0.9 * all) ++answered;
  }
  // A photograph that needs no exchange may have nearly the same directions.
  EXPECT_GT(answered, 0.8 * static_cast<double>(batch.size()));
  // Its pixel, which has the light's cosine, is scaled to that of the camera: the sphere is matte.
  codec::BlockCache cache(model.files, size_t{1} << 28);
  ShadingStats stats;
  const std::vector<Rgb> radiance = shade(plan, cache, stats);
  double squares = 0;
  for (uint32_t query = 0; query < batch.size(); ++query) {
    const Rgb truth = lambert(Studio{}.albedo, {1, 1, 1}, model.cloud.p0[batch.surfels[query]].raw(),
                              batch.towardsLight[query].raw());
    squares += std::pow(radiance[query].g / truth.g - 1, 2);
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(batch.size())), 0.022);
}

TEST_F(PairWeight, SameBitsForAnyNumberOfThreadsAndAnyCache) {
  QueryBatch batch = randomBatch(model, 3000, 2, random);
  for (size_t entry = 0; entry < batch.towardsLight.size(); ++entry)
    batch.reached.push_back(static_cast<float>(random() % 3) / 2);
  const auto shadedBy = [&](int threads, size_t cacheBytes) {
    codec::BlockCache cache(model.files, cacheBytes);
    ShadingStats stats;
    tbb::task_arena arena(threads);
    return arena.execute([&] { return shade(model, batch, kReciprocal, cache, stats).radiance; });
  };
  const std::vector<Rgb> radiance = shadedBy(1, size_t{1} << 28);
  EXPECT_EQ(shadedBy(4, size_t{1} << 28), radiance);
  EXPECT_EQ(shadedBy(3, 0), radiance);
}

TEST_F(PairWeight, OnlyKrigingThatIsForeshortenedIsReciprocal) {
  EXPECT_TRUE(isReciprocal(model, kReciprocal));
  for (const Interpolation other : {Interpolation::paper, Interpolation::separate}) {
    ShadeOptions options = kReciprocal;
    options.interpolation = other;
    EXPECT_FALSE(isReciprocal(model, options));
  }
  ShadeOptions options = kReciprocal;
  options.foreshortened = false;
  EXPECT_FALSE(isReciprocal(model, options));
}

// In shadow there is no highlight: scales of half vectors are wider than those of gloss. Between, they change
// evenly.
TEST_F(PairWeight, ScalesDependOnTheShadowState) {
  const float halfScale = model.interpolation.halfScale;
  const KrigingScales lit = scalesFor(halfScale, 1), shadow = scalesFor(halfScale, 0);
  EXPECT_FLOAT_EQ(lit.half, model.interpolation.halfScale);
  EXPECT_GT(shadow.half, lit.half);
  float before = shadow.half;
  for (float reached = 0.01f; reached <= 1; reached += 0.01f) {
    const float half = scalesFor(halfScale, reached).half;
    EXPECT_LT(half, before);
    before = half;
  }
}

// Rotates a direction about an axis.
template <class D> D rotated(const D& direction, const Vec3<float>& axis, float angle) {
  return assume<D>(Vec3<float>(Eigen::AngleAxisf(angle, axis) * direction.raw()));
}

enum class Moving { viewer, light, surface, warp, shadow };

// A path of 0.3 radians: the viewer or the light goes around the surfel, the surfel moves over the sphere, or
// a warp turns the surfel, which turns both directions; or the light comes out of a shadow.
struct Path {
  Moving moving;
  uint32_t surfel;
  Direction3<AcquisitionSpace> towardsView, towardsLight;
  Vec3<float> axis;
  float reached;
};

constexpr float kLength = 0.3f; // of a path, radians
constexpr size_t kPathSteps = 1024, kStepsPerDegree = 60;

struct LargestChange {
  double fine = 0, coarse = 0; // of a photograph's weight in one step, and in two
  double moved = 0;            // from photographs to others in a degree
};

// Uses the model's surfels from `first` on.
LargestChange largestChange(model::Model& model, const Path& path, uint32_t first,
                            const ShadeOptions& options) {
  QueryBatch batch;
  batch.lights = 1;
  for (size_t step = 0; step <= kPathSteps; ++step) {
    const float angle = kLength * static_cast<float>(step) / kPathSteps;
    const auto surfel = first + static_cast<uint32_t>(step);
    const bool turnsView = path.moving == Moving::viewer || path.moving == Moving::warp;
    const bool turnsLight = path.moving == Moving::light || path.moving == Moving::warp;
    model.cloud.p0[surfel] = model.cloud.p0[path.surfel];
    model.cloud.r0[surfel] = model.cloud.r0[path.surfel];
    if (path.moving == Moving::surface) {
      model.cloud.p0[surfel] = rotated(model.cloud.p0[path.surfel], path.axis, angle);
      model.cloud.r0[surfel] = rodriguesOf(rotated(normalOf(model, path.surfel), path.axis, angle));
    }
    for (auto* states : {&model.visibility, &*model.lightVisibility})
      std::ranges::copy(states->of(path.surfel), states->values.begin() + surfel * states->views);
    addQuery(batch, surfel, turnsView ? rotated(path.towardsView, path.axis, angle) : path.towardsView,
             turnsLight ? rotated(path.towardsLight, path.axis, angle) : path.towardsLight);
    batch.reached.push_back(path.moving == Moving::shadow ? static_cast<float>(step) / kPathSteps
                                                          : path.reached);
  }
  const ShadingPlan plan = planShading(model, batch, options);
  const size_t lights = model.rig.lights.size();
  std::vector<std::vector<double>> shares(batch.size(), std::vector<double>(model.rig.views.size() * lights));
  for (const ShadingOp& op : plan.ops)
    for (const auto& [light, factor] : rowOf(plan, op))
      shares[op.target][op.view * lights + light] +=
          op.weight * factor.r * capturedIrradiance(model, op, light, batch.surfels[op.target]).r;
  for (auto& ofStep : shares) {
    const double all = std::accumulate(ofStep.begin(), ofStep.end(), 0.0); // times the foreshortening
    for (double& share : ofStep) share /= all;
  }
  struct Change {
    double largest = 0, sum = 0;
  };
  const auto changeFrom = [&](size_t before, size_t after) {
    Change change;
    for (size_t i = 0; i < shares[after].size(); ++i) {
      const double share = std::abs(shares[after][i] - shares[before][i]);
      change.largest = std::max(change.largest, share);
      change.sum += share;
    }
    return change;
  };
  LargestChange largest;
  for (size_t step = 1; step <= kPathSteps; ++step) {
    largest.fine = std::max(largest.fine, changeFrom(step - 1, step).largest);
    if (step % 2 == 0) largest.coarse = std::max(largest.coarse, changeFrom(step - 2, step).largest);
    if (step >= kStepsPerDegree)
      largest.moved = std::max(largest.moved, changeFrom(step - kStepsPerDegree, step).sum / 2);
  }
  return largest;
}

// The largest changes along random paths. Adds a surfel to the model for each step of a path.
struct LargestChanges {
  double jump = 0;  // of a weight, by which half the step has more than 0.6 times its change
  double worst = 0; // of a weight in a step
  double moved = 0; // LargestChange::moved, without paths out of a shadow, which are not angles
};
LargestChanges largestChanges(model::Model& model, std::mt19937& random, const ShadeOptions& options,
                              int paths = 1000) {
  const auto first = static_cast<uint32_t>(model.cloud.size());
  model.cloud.p0.resize(first + kPathSteps + 1);
  model.cloud.r0.resize(first + kPathSteps + 1);
  model.visibility.values.resize(model.cloud.size() * model.visibility.views);
  model.lightVisibility->values.resize(model.cloud.size() * model.lightVisibility->views);
  LargestChanges all;
  for (int i = 0; i < paths; ++i) {
    const auto surfel = static_cast<uint32_t>(random() % first);
    const auto outwards = [&] {
      const auto direction = studio::randomDirection(random);
      return direction.raw().dot(model.cloud.p0[surfel].raw()) > 0 ? direction : -direction;
    };
    const Path path{static_cast<Moving>(i % 5),   surfel, outwards(), outwards(), randomUnit<float>(random),
                    random() % 4 == 0 ? 0.f : 1.f};
    const LargestChange change = largestChange(model, path, first, options);
    all.jump = std::max(all.jump, change.fine - 0.6 * change.coarse);
    all.worst = std::max(all.worst, change.fine);
    if (path.moving != Moving::shadow) all.moved = std::max(all.moved, change.moved);
  }
  return all;
}

TEST_F(PairWeight, ChangesContinuouslyAndLittleWithinADegreeAlongAThousandPaths) {
  const LargestChanges changes = largestChanges(model, random, kReciprocal);
  EXPECT_LT(changes.jump, 0.01);
  EXPECT_LT(changes.worst, 0.02);
  // Else a highlight seems to jump as a lamp moves. The captured lights are about 45 degrees apart.
  EXPECT_LT(changes.moved, 1.0 / 3);
}

// With a few gaps, pairs of near views and lights are weighted as in a full product.
class PairWeightWithGaps : public NearPairQueries {
protected:
  PairWeightWithGaps() { model.interpolation.halfScale = 0.2f; }
};

TEST_F(PairWeightWithGaps, ChangesContinuouslyAlongAThousandPaths) {
  const LargestChanges changes = largestChanges(model, random, kReciprocal);
  EXPECT_LT(changes.jump, 0.01);
  EXPECT_LT(changes.worst, 0.02);
}

class GappyPairWeight : public PairQueries {
protected:
  GappyPairWeight() { model.interpolation.halfScale = 0.2f; }
};

TEST_F(GappyPairWeight, LittleWeightMovesWithinADegree) {
  const size_t lights = model.rig.lights.size();
  model.lightVisibility = {lights, std::vector<uint8_t>(model.cloud.size() * lights, 255)};
  EXPECT_LT(largestChanges(model, random, {.interpolation = Interpolation::kriging}, 200).moved, 0.5);
}

} // namespace
} // namespace surflect::weights
