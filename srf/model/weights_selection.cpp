#include "srf/model/weights_selection.h"

#include "srf/codec/block_cache.h"
#include "srf/image/color.h"
#include "srf/proxy/relief/photometric.h"
#include "srf/reflectance/clusters.h"
#include "srf/reflectance/gains.h"
#include "srf/shading/plan.h"
#include "srf/shading/shade.h"
#include "srf/weights/irradiance_ratio.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <vector>

namespace surflect::model {

namespace {

// Largest spacing of lights, in radians, at which blends are foreshortened. A surface that faces one light
// squarely then has at least half the irradiance from the next, which stays within the limit of
// foreshortening().
constexpr double kForeshortenedSpacing = std::numbers::pi / 3;

// Fits that may be foreshortened. Photometric normals are as rough as a relief integrated from them: they
// would put a mean off by tens of percent, but a plane, which needs only a small correction, by a few
// percent.
std::vector<weights::LightFit> foreshortenedFits(NormalsFrom normals, double spacing) {
  if (normals == NormalsFrom::nothing || spacing > kForeshortenedSpacing) return {};
  if (normals == NormalsFrom::photographs) return {weights::LightFit::plane};
  return {weights::LightFit::mean, weights::LightFit::plane};
}

// Candidate blends, simplest first, that still work with one of `lights` left out: a blend of k also needs
// the light after its k-th. A plane of three lights is excluded, as it turns too steeply when a fourth light
// is as near.
std::vector<weights::LightBlend> candidatesFor(size_t lights,
                                               std::span<const weights::LightFit> foreshortened) {
  std::vector<weights::LightBlend> candidates;
  for (const size_t blended : {3, 4, 5, 6, 8}) {
    if (blended + 2 > lights) break;
    for (const weights::LightFit fit : {weights::LightFit::mean, weights::LightFit::plane}) {
      if (fit == weights::LightFit::plane && blended == 3) continue;
      candidates.push_back({blended, fit, false});
      if (std::ranges::find(foreshortened, fit) != foreshortened.end())
        candidates.push_back({blended, fit, true});
    }
  }
  return candidates;
}

float shown(float radiance, float white) {
  return image::srgbFromLinear(std::clamp(radiance / white, 0.f, 1.f));
}

} // namespace

ReflectanceSamples::ReflectanceSamples(std::vector<Direction3<AcquisitionSpace>> towards,
                                       std::vector<Rgb> irradiance)
    : towards_(std::move(towards)), irradiance_(std::move(irradiance)), reflectance_(towards_.size()) {
  assert(towards_.size() == irradiance_.size());
}

void ReflectanceSamples::add(std::span<const Rgb> reflectance, const Normal3<AcquisitionSpace>& normal) {
  normals_.push_back(normal);
  assert(reflectance.size() == reflectance_.size());
  for (size_t light = 0; light < reflectance.size(); ++light) {
    reflectance_[light].r.push_back(reflectance[light].r);
    reflectance_[light].g.push_back(reflectance[light].g);
    reflectance_[light].b.push_back(reflectance[light].b);
  }
}

// Photometric normal of each texel, refitted without one light; zero where the other lights determine none.
std::vector<Normal3<AcquisitionSpace>> ReflectanceSamples::normalsWithout(size_t light,
                                                                          const Progress& progress) const {
  std::vector<size_t> others;
  std::vector<Vec3<double>> towards;
  for (size_t other = 0; other < towards_.size(); ++other) {
    if (other == light) continue;
    others.push_back(other);
    towards.push_back(towards_[other].raw().cast<double>());
  }
  std::vector<Normal3<AcquisitionSpace>> normals;
  std::vector<Rgb> shares(others.size());
  for (size_t texel = 0; texel < normals_.size(); ++texel) {
    progress.checkNowAndThen(texel);
    for (size_t i = 0; i < others.size(); ++i) {
      const auto& [r, g, b] = reflectance_[others[i]];
      shares[i] = std::numbers::pi_v<float> * Rgb{r[texel], g[texel], b[texel]};
    }
    normals.push_back(
        assume<Normal3<AcquisitionSpace>>(relief::fitLambert(towards, shares).normal.cast<float>()));
  }
  return normals;
}

// Sum of squared errors of each candidate, for the photographs of `light` predicted from the other lights.
std::vector<double> ReflectanceSamples::leftOutErrors(size_t light,
                                                      std::span<const weights::LightBlend> candidates,
                                                      std::span<const Normal3<AcquisitionSpace>> normals,
                                                      float white, const Progress& progress) const {
  std::vector<size_t> indices;
  std::vector<Direction3<AcquisitionSpace>> others;
  std::vector<Direction3<AcquisitionSpace, double>> covering;
  for (size_t other = 0; other < towards_.size(); ++other) {
    if (other == light) continue;
    indices.push_back(other);
    others.push_back(towards_[other]);
    covering.push_back(towards_[other].cast<double>());
  }
  const weights::LightExtrapolationFade coverage(covering);
  std::vector<weights::BlendSet> blends;
  for (const weights::LightBlend& candidate : candidates)
    blends.push_back(weights::blendOfLights(others, towards_[light], candidate, coverage,
                                            weights::LightExtrapolation::clamp));

  // Foreshortening factor of a texel's blend, candidate by candidate.
  std::set<uint32_t> blended; // only a few, however many lights exist
  for (size_t c = 0; c < candidates.size(); ++c)
    if (candidates[c].foreshortened)
      for (const auto& [other, weight] : blends[c]) blended.insert(other);
  std::vector<float> factors, cosines(others.size());
  for (size_t texel = 0; texel < normals.size(); ++texel) {
    progress.checkNowAndThen(texel);
    for (const uint32_t other : blended)
      cosines[other] = weights::foreshortenedCosine(normals[texel], others[other]);
    const float asked = weights::foreshortenedCosine(normals[texel], towards_[light]);
    for (size_t c = 0; c < candidates.size(); ++c)
      factors.push_back(candidates[c].foreshortened
                            ? weights::foreshortening(asked, weights::blendedCosine(blends[c], cosines))
                            : 1);
  }

  std::vector<double> errors(candidates.size());
  const auto addChannel = [&](std::vector<float> Channels::*channel, float irradiance) {
    const auto& truth = reflectance_[light].*channel;
    for (size_t texel = 0; texel < truth.size(); ++texel) {
      progress.checkNowAndThen(texel);
      const float wanted = shown(irradiance * truth[texel], white);
      for (size_t c = 0; c < candidates.size(); ++c) {
        float got = 0;
        for (const auto& [other, weight] : blends[c])
          got += weight * (reflectance_[indices[other]].*channel)[texel];
        got *= factors[texel * candidates.size() + c];
        const float difference = shown(irradiance * got, white) - wanted;
        errors[c] += difference * difference;
      }
    }
  };
  addChannel(&Channels::r, irradiance_[light].r);
  addChannel(&Channels::g, irradiance_[light].g);
  addChannel(&Channels::b, irradiance_[light].b);
  return errors;
}

LightBlendSelection ReflectanceSamples::choose(double white, NormalsFrom normals,
                                               const Progress& progress) const {
  constexpr double kGoodEnough = 1.12;
  constexpr double kUnseen = 1 / (12 * 255.0 * 255.0); // squared error of rounding to 8 bits
  const size_t lights = towards_.size();
  std::vector<Direction3<AcquisitionSpace, double>> covering;
  for (const auto& towards : towards_) covering.push_back(towards.cast<double>());
  const auto fits = foreshortenedFits(normals, weights::LightExtrapolationFade(covering).spacing());
  const auto candidates = candidatesFor(lights, fits);
  if (candidates.empty() || reflectance_[0].r.empty()) return {};
  std::vector<std::vector<double>> ofLight(lights);
  tbb::parallel_for(size_t{0}, lights, [&](size_t light) {
    const bool areToldAgain = !fits.empty() && normals == NormalsFrom::photographs;
    ofLight[light] =
        leftOutErrors(light, candidates, areToldAgain ? normalsWithout(light, progress) : normals_,
                      static_cast<float>(white), progress);
  });
  std::vector<double> errors(candidates.size());
  for (const auto& part : ofLight)
    for (size_t c = 0; c < errors.size(); ++c) errors[c] += part[c];

  const double least = *std::ranges::min_element(errors);
  size_t chosen = 0;
  const auto values = static_cast<double>(3 * reflectance_[0].r.size() * lights);
  while (errors[chosen] > std::max(kGoodEnough * least, kUnseen * values)) ++chosen;
  return {candidates[chosen], -10 * std::log10(std::max(errors[chosen] / values, 1e-30))};
}

namespace {

constexpr size_t kSurfels = 1000, kFolds = 96; // sampled surfels, and pairs of a camera and a light left out
constexpr double kSeenWell = 0.5;              // least visibility weight
constexpr double kGainDb = 1;                  // least gain of kriging over separate weights
constexpr double kTableGainDb = 0.3;           // least gain of tables over the choice without

struct Candidate {
  weights::InterpolationChoice choice;
  bool foreshortened = false;
};

// The first is that of separate weights.
std::vector<Candidate> candidatesFor(const Model& model, bool hasNormals) {
  std::vector<Candidate> candidates{{{}, model.lightBlend.foreshortened}};
  for (const bool foreshortened : {false, true}) {
    const bool isPossible =
        model.isFullProduct ? foreshortened == model.lightBlend.foreshortened : !foreshortened || hasNormals;
    if (!isPossible) continue;
    for (const bool shadows : {false, true})
      for (const bool reciprocal : {false, true})
        for (const float half : {1.6f, 0.8f, 0.4f, 0.2f, 0.1f})
          if ((!reciprocal || foreshortened) && (!shadows || model.lightVisibility))
            candidates.push_back(
                {{weights::Interpolation::kriging, half, reciprocal, shadows}, foreshortened});
  }
  return candidates;
}

weights::VisibilityWeights rowsOf(const weights::VisibilityWeights& weights,
                                  std::span<const uint32_t> surfels) {
  weights::VisibilityWeights rows{weights.views, {}};
  for (const uint32_t surfel : surfels) {
    const auto row = weights.of(surfel);
    rows.values.insert(rows.values.end(), row.begin(), row.end());
  }
  return rows;
}

weights::VisibilityWeights withoutColumn(const weights::VisibilityWeights& weights, size_t column) {
  weights::VisibilityWeights rest{weights.views - 1, {}};
  for (size_t i = 0; i < weights.values.size(); ++i)
    if (i % weights.views != column) rest.values.push_back(weights.values[i]);
  return rest;
}

// A model with the choices of another, its surfels, and no files.
Model withSurfels(const Model& model, SurfelCloud cloud, weights::VisibilityWeights visibility,
                  std::optional<weights::VisibilityWeights> lightVisibility) {
  Model field;
  field.rig = model.rig;
  field.cloud = std::move(cloud);
  field.middle = model.middle;
  field.visibility = std::move(visibility);
  field.lightVisibility = std::move(lightVisibility);
  field.columns = model.columns;
  field.lightBlend = model.lightBlend;
  field.isFullProduct = model.isFullProduct;
  field.hasNearPairs = model.hasNearPairs;
  return field;
}

// Shared reflectance of some surfels.
reflectance::SharedReflectance rowsOf(const reflectance::SharedReflectance& shared,
                                      std::span<const uint32_t> surfels) {
  reflectance::SharedReflectance rows{shared.white, shared.tables, shared.trust, {}, {}, {}, {}};
  for (const uint32_t surfel : surfels) {
    rows.tilts.push_back(shared.tilts[surfel]);
    rows.fibres.push_back(shared.fibres[surfel]);
    rows.mixtures.push_back(shared.mixtures[surfel]);
    rows.gains.push_back(shared.gains[surfel]);
  }
  return rows;
}

// Evenly chosen surfels of a model.
Model sampleOf(const Model& model, std::span<const uint32_t> surfels) {
  Model sample = withSurfels(model, subsetOf(model.cloud, surfels), rowsOf(model.visibility, surfels),
                             model.lightVisibility ? std::optional(rowsOf(*model.lightVisibility, surfels))
                                                   : std::nullopt);
  return sample;
}

// Evenly chosen numbers, about `few` of 0..count - 1.
std::vector<uint32_t> evenlyChosen(size_t count, size_t few) {
  std::vector<uint32_t> chosen;
  const size_t step = std::max(size_t{1}, count / few);
  for (size_t i = step / 2; i < count; i += step) chosen.push_back(static_cast<uint32_t>(i));
  return chosen;
}

// A photograph to be predicted, and what is removed from the model to predict it. Its column is its number in
// its view.
struct Fold {
  size_t view, column, light;
  bool leavesView, leavesLight; // out; if neither, only the photograph
};

// Folds, spread evenly over cameras and lights. A capture with gaps loses single photographs; others lose the
// camera, the light, or both in turn, as renderings may have new cameras, new lights, or both. Only every
// `step`-th camera or light leaves.
std::vector<Fold> foldsOf(const Model& model, size_t step = 1) {
  std::vector<Fold> all;
  for (size_t view = 0; view < model.columns.size(); ++view)
    for (size_t column = 0; column < model.columns[view].size(); ++column)
      all.push_back({view, column, model.columns[view][column], false, false});
  std::vector<Fold> folds;
  const size_t count = std::min(kFolds, all.size()), views = model.rig.views.size(),
               lights = model.rig.lights.size();
  const auto leaving = [step](size_t i) { return i - i % step; };
  for (size_t fold = 0; fold < count; ++fold) {
    const size_t view = fold * views / count, light = fold * 7919 % lights; // 7919 is prime
    const bool leavesView = fold % 3 != 1, leavesLight = fold % 3 != 0;
    const size_t ofLight = leavesLight ? leaving(light) : light;
    folds.push_back(model.isFullProduct
                        ? Fold{leavesView ? leaving(view) : view, ofLight, ofLight, leavesView, leavesLight}
                        : all[fold * all.size() / count]);
  }
  return folds;
}

// Photographs that no fold leaves out.
IsUsed keptBy(const std::vector<Fold>& folds) {
  std::set<size_t> views, lights;
  std::set<std::pair<size_t, size_t>> photographs;
  for (const Fold& fold : folds) {
    if (fold.leavesView) views.insert(fold.view);
    if (fold.leavesLight) lights.insert(fold.light);
    photographs.insert({fold.view, fold.light});
  }
  return [=](size_t view, size_t light) {
    return !views.contains(view) && !lights.contains(light) && !photographs.contains({view, light});
  };
}

// The sample without what the fold leaves out. Visibility and normals stay those of the whole capture.
Model without(const Model& sample, const Fold& left) {
  const bool hasLess = left.leavesLight && sample.lightVisibility;
  Model rest = withSurfels(
      sample, sample.cloud, left.leavesView ? withoutColumn(sample.visibility, left.view) : sample.visibility,
      hasLess ? std::optional(withoutColumn(*sample.lightVisibility, left.light)) : sample.lightVisibility);
  rest.shared = sample.shared;
  const auto at = [](auto& list, size_t index) { return list.begin() + static_cast<std::ptrdiff_t>(index); };
  if (left.leavesView) {
    rest.rig.views.erase(at(rest.rig.views, left.view));
    rest.columns.pop_back(); // each view has all lights
  }
  if (left.leavesLight) {
    rest.rig.lights.erase(at(rest.rig.lights, left.light));
    for (auto& ofView : rest.columns) ofView.pop_back();
  }
  if (!left.leavesView && !left.leavesLight)
    rest.columns[left.view].erase(at(rest.columns[left.view], left.column));
  return rest;
}

// Queries for the photograph of a view and a light, by the surfels that the view sees.
weights::QueryBatch queriesFor(const Model& sample, size_t view, size_t light) {
  weights::QueryBatch batch;
  batch.lights = 1;
  const capture::Viewpoint viewpoint(sample.rig.views[view].camera);
  const capture::Light& source = sample.rig.lights[light];
  for (uint32_t surfel = 0; surfel < sample.cloud.size(); ++surfel) {
    if (weights::VisibilityWeights::decode(sample.visibility.of(surfel)[view]) < kSeenWell) continue;
    const auto p0 = sample.cloud.p0[surfel].cast<double>();
    const auto towardsLight = capture::towardsLight(source, p0);
    batch.surfels.push_back(surfel);
    batch.towardsView.push_back(viewpoint.towards(p0).cast<float>());
    batch.towardsLight.push_back(towardsLight.cast<float>());
    batch.irradiance.push_back(capture::irradianceAt(source, p0));
    if (sample.lightVisibility)
      batch.reached.push_back(
          weights::VisibilityWeights::decode(sample.lightVisibility->of(surfel)[light]) < 0.5f ? 0.f : 1.f);
  }
  return batch;
}

// Look-ups of the photograph itself.
shading::ShadingPlan truthOf(const Model& sample, const weights::QueryBatch& batch, size_t view,
                             size_t column) {
  shading::ShadingPlan plan;
  plan.places = batch.size();
  plan.rows.add(static_cast<uint32_t>(column), {1, 1, 1});
  for (uint32_t query = 0; query < batch.size(); ++query)
    if (const auto pixel =
            sample.rig.views[view].camera.project(sample.cloud.p0[batch.surfels[query]].cast<double>()))
      plan.ops.push_back({query, static_cast<uint32_t>(view), static_cast<float>(pixel->x),
                          static_cast<float>(pixel->y), 1, 0, 1});
  return plan;
}

// Gives a plan for the rest the numbers of views and columns of the whole.
void renumber(shading::ShadingPlan& plan, const Fold& left) {
  const auto skip = [](uint32_t& number, size_t gap) { number += number >= gap ? 1 : 0; };
  if (left.leavesView)
    for (shading::ShadingOp& op : plan.ops) skip(op.view, left.view);
  if (left.leavesLight)
    for (auto& weight : plan.rows.weights) skip(weight.light, left.column);
  if (left.leavesView || left.leavesLight) return;
  for (const shading::ShadingOp& op : plan.ops) { // each has a row of its own
    if (op.view != left.view) continue;
    for (uint32_t i = op.rowBegin; i < op.rowEnd; ++i)
      for (uint32_t j = plan.rows.lights[i].begin; j < plan.rows.lights[i].end; ++j)
        skip(plan.rows.weights[j].light, left.column);
  }
}

// Sums of squared errors of values clipped at white.
struct Errors {
  double linear = 0, shown = 0;
  size_t values = 0;

  void add(std::span<const Rgb> got, std::span<const Rgb> wanted, float white) {
    const auto addChannel = [&](float a, float b) {
      const float x = std::clamp(a / white, 0.f, 1.f), y = std::clamp(b / white, 0.f, 1.f);
      linear += (x - y) * (x - y);
      const float difference = image::srgbFromLinear(x) - image::srgbFromLinear(y);
      shown += difference * difference;
      ++values;
    };
    for (size_t i = 0; i < got.size(); ++i) {
      addChannel(got[i].r, wanted[i].r);
      addChannel(got[i].g, wanted[i].g);
      addChannel(got[i].b, wanted[i].b);
    }
  }
  // Mean of both PSNRs.
  double db() const {
    constexpr double kLeast = 1e-12;
    const auto count = static_cast<double>(values);
    return -5 * (std::log10(linear / count + kLeast) + std::log10(shown / count + kLeast));
  }
};

// Predicts photographs that are left out of a model.
class LeaveOneOut {
public:
  // The model, of which `sample` are some surfels, must outlive this.
  LeaveOneOut(const Model& model, Model sample, const Progress& progress)
      : sample_(std::move(sample)), white_(static_cast<float>(model.white)),
        cache_(model.files, size_t{256} << 20), progress_(progress) {}

  const Model& sample() const { return sample_; }
  void setTrust(const std::vector<float>& trust) { sample_.shared->trust = trust; }
  float white() const { return white_; }

  // Calls use(fold, surfels, candidate, predicted, truth) for each fold that shows surfels, and each
  // candidate.
  template <class Use>
  void predict(std::span<const Fold> folds, std::span<const Candidate> candidates, const Use& use) {
    for (size_t fold = 0; fold < folds.size(); ++fold) {
      progress_("weights of photographs", static_cast<double>(fold) / static_cast<double>(folds.size()));
      const Fold& left = folds[fold];
      weights::QueryBatch batch = queriesFor(sample_, left.view, left.light);
      if (batch.size() == 0) continue;
      Model rest = without(sample_, left);
      const auto truth = shading::shade(truthOf(sample_, batch, left.view, left.column), cache_, stats_);
      const std::vector<float> reached = batch.reached;
      for (size_t c = 0; c < candidates.size(); ++c) {
        progress_.checkpoint();
        rest.interpolation = candidates[c].choice;
        rest.lightBlend.foreshortened = candidates[c].foreshortened;
        batch.reached = weights::usesShadowStates(rest, {}) ? reached : std::vector<float>{};
        shading::ShadingPlan plan = shading::planShading(rest, batch, {});
        renumber(plan, left);
        use(left, batch.surfels, c, shading::shade(plan, cache_, stats_), truth);
      }
    }
  }

private:
  Model sample_;
  float white_;
  codec::BlockCache cache_;
  shading::ShadingStats stats_;
  const Progress& progress_;
};

// Errors of a candidate over all folds, and over those whose camera stays.
struct CandidateErrors {
  Errors all, ofKeptViews;

  void add(const Fold& left, std::span<const Rgb> predicted, std::span<const Rgb> truth, float white) {
    all.add(predicted, truth, white);
    if (!left.leavesView) ofKeptViews.add(predicted, truth, white);
  }
  // Whether the error is less than another's by `gain` dB, in both.
  bool gains(const CandidateErrors& other, double gain) const {
    const auto isLess = [gain](const Errors& own, const Errors& others) {
      return others.values == 0 || own.db() >= others.db() + gain;
    };
    return isLess(all, other.all) && isLess(ofKeptViews, other.ofKeptViews);
  }
};

// Selection between tables and another choice.
struct TableSelection {
  std::vector<float> trust;      // in the model's tables
  bool isBetter = false;         // with tables
  double db = 0, separateDb = 0; // of photographs that are left out: with tables, and with separate weights
};

// Squared differences of logarithms with tables and without, by the table of largest weight at each surfel.
class TableErrors {
public:
  explicit TableErrors(const reflectance::ReflectanceTables& tables) : sums_(tables.count()) {}

  void add(const reflectance::TableMixture& mixture, size_t candidate, float error) {
    const auto largest = std::ranges::max_element(mixture.weight) - mixture.weight.begin();
    sums_[mixture.table[static_cast<size_t>(largest)]][candidate] += error;
  }
  std::vector<float> trust() const {
    std::vector<float> all;
    for (const auto& [with, without] : sums_)
      all.push_back(reflectance::tableShare(static_cast<float>(with), static_cast<float>(without)));
    return all;
  }

private:
  std::vector<std::array<double, 2>> sums_;
};

// Candidates: with tables, without, separate. The tables that are tried are fitted without every fourth
// camera and light; each fold leaves one of these out of the photographs that correct them, too. Trust and
// the comparison that follows use the same folds: half of the folds would be too few for either.
TableSelection selectTables(const Model& model, const SharedSample& shared,
                            std::span<const Candidate, 3> candidates, const Progress& progress) {
  constexpr size_t kApart = 4;
  const std::vector<Fold> folds = foldsOf(model, kApart);
  const reflectance::SharedReflectance tried = refitSample(model, shared, keptBy(folds), progress);
  const std::vector<uint32_t> rows = evenlyChosen(shared.surfels.size(), kSurfels);
  std::vector<uint32_t> surfels;
  for (const uint32_t row : rows) surfels.push_back(shared.surfels[row]);
  Model sample = sampleOf(model, surfels);
  sample.shared = rowsOf(tried, rows);
  const std::vector<reflectance::TableMixture> mixtures = sample.shared->mixtures;
  LeaveOneOut leaveOneOut(model, std::move(sample), progress);

  TableErrors ofTables(tried.tables);
  leaveOneOut.predict(folds, candidates.first(2),
                      [&](const Fold&, std::span<const uint32_t> asked, size_t c,
                          std::span<const Rgb> predicted, std::span<const Rgb> truth) {
                        for (size_t i = 0; i < asked.size(); ++i)
                          ofTables.add(mixtures[asked[i]], c,
                                       reflectance::logError(predicted[i], truth[i], leaveOneOut.white()));
                      });
  leaveOneOut.setTrust(ofTables.trust());
  std::array<CandidateErrors, 3> errors;
  leaveOneOut.predict(
      folds, candidates,
      [&](const Fold& left, std::span<const uint32_t>, size_t c, std::span<const Rgb> predicted,
          std::span<const Rgb> truth) { errors[c].add(left, predicted, truth, leaveOneOut.white()); });
  return {ofTables.trust(), errors[0].gains(errors[1], kTableGainDb), errors[0].all.db(), errors[2].all.db()};
}

} // namespace

bool canLeaveOut(const Model& model) {
  constexpr size_t kFewest = 4;
  return model.rig.views.size() >= kFewest && model.rig.lights.size() >= kFewest && model.cloud.size() > 0;
}

InterpolationSelection selectInterpolation(const Model& model, bool hasNormals, const SharedSample* shared,
                                           const Progress& progress) {
  if (!canLeaveOut(model)) return {};
  LeaveOneOut leaveOneOut(model, sampleOf(model, evenlyChosen(model.cloud.size(), kSurfels)), progress);
  const std::vector<Candidate> candidates = candidatesFor(model, hasNormals);
  std::vector<CandidateErrors> errors(candidates.size());
  leaveOneOut.predict(
      foldsOf(model), candidates,
      [&](const Fold& left, std::span<const uint32_t>, size_t c, std::span<const Rgb> predicted,
          std::span<const Rgb> truth) { errors[c].add(left, predicted, truth, leaveOneOut.white()); });
  if (errors[0].all.values == 0) return {};
  std::vector<double> db;
  for (const CandidateErrors& each : errors) db.push_back(each.all.db());
  const auto best = static_cast<size_t>(std::max_element(db.begin() + 1, db.end()) - db.begin());
  InterpolationSelection selection{
      candidates[best].choice, candidates[best].foreshortened, {}, {{db[best], db[0]}}};
  const bool usesKriging = errors[best].gains(errors[0], kGainDb);
  if (!usesKriging) {
    selection.choice.kind = weights::Interpolation::separate;
    selection.leftOut->chosenDb = db[0];
  }
  if (!shared) return selection;

  std::array<Candidate, 3> withTables{candidates[best], usesKriging ? candidates[best] : candidates[0],
                                      candidates[0]};
  withTables[0].choice.kind = weights::Interpolation::shared;
  withTables[0].choice.otherwise =
      usesKriging ? weights::Interpolation::kriging : weights::Interpolation::separate;
  withTables[0].foreshortened = withTables[1].foreshortened;
  TableSelection tables = selectTables(model, *shared, withTables, progress);
  selection.trust = std::move(tables.trust);
  if (tables.isBetter) {
    selection.choice = withTables[0].choice;
    selection.foreshortened = withTables[0].foreshortened;
    selection.leftOut = {tables.db, tables.separateDb};
  }
  return selection;
}

} // namespace surflect::model
