// Symbols: p0 place of the surfel; X_ij reflectance image of view i and captured light j, x_i projection of
// p0 in view i, a_i alpha there; theta_i angle at p0 between view i and the viewer, theta_qj between light q
// of the query and captured light j; s_i visibility weight of view i; E_q irradiance of light q, E_j of
// captured light j.
//
//   p_i = (1 - cos theta_i) / s_i        penalty of a view, or its penalty as a fallback if less
//   w_i = ULR(p)_i                       weight of a view                       [Weyrich 2005, §5.2]
//   u_qj = ULR(1 - cos theta_q)_j        weight of a captured light             [Weyrich 2005, §5.2]
//   w_j = sum_q f_q u_qj E_q / E_j       f_q: foreshortening
//   L = sum_i w_i a_i sum_j w_j X_ij(x_i)    radiance
//
// With a weight error, w_i, u_qj and the weights of pairs are truncated (srf/weights/ulr.h).
//
// Under kriging, with w_ij as in srf/weights/pair_weights.h:
//   L = sum_q f_q sum_ij w_ij a_i E_q / E_j X_ij(x_i)
//
// Where tables answer with it, L has a share 1 - m of that, and m of the radiance in
// srf/weights/shared_weights.h. Light of environments has the correction of srf/weights/environment_tables.h.
//
// Otherwise, a capture with gaps has weights of pairs:
//   L = sum_q sum_ij ULR(p_i + 1 - cos theta_qj)_ij a_i E_q / E_j X_ij(x_i).
#include "srf/shading/reference.h"

#include "srf/reflectance/correction.h"
#include "srf/shading/taps.h"
#include "srf/weights/fades.h"
#include "srf/weights/fallback_view.h"
#include "srf/weights/irradiance_ratio.h"
#include "srf/weights/light_weights.h"
#include "srf/weights/pair_weights.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace surflect::shading {

namespace {

using weights::anglePenalty;
using weights::QueryBatch;
using weights::QueryEnvironment;
using weights::ReflectanceField;
using weights::ShadeOptions;

// A texel of a bilinear look-up that shows the object, and its weight.
struct PlainTap {
  double weight;
  std::shared_ptr<const codec::Block> block;
  int texel;
};

// The taps at (x, y) of a view, with weights that sum to 1; none if all four texels are background.
std::vector<PlainTap> tapsAt(codec::BlockCache& cache, uint32_t view, double x, double y) {
  const codec::ViewFile& file = cache.views()[view];
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  std::vector<PlainTap> taps;
  double weights = 0;
  for (const double tx : {left, left + 1})
    for (const double ty : {top, top + 1}) {
      const double weight = (1 - std::abs(x - 0.5 - tx)) * (1 - std::abs(y - 0.5 - ty));
      const int column = static_cast<int>(std::clamp<double>(tx, 0, file.header().width - 1)),
                row = static_cast<int>(std::clamp<double>(ty, 0, file.header().height - 1));
      const auto number = file.find({column / codec::blockSize, row / codec::blockSize});
      if (weight == 0 || !number) continue;
      taps.push_back({weight, cache.get(view, *number),
                      row % codec::blockSize * codec::blockSize + column % codec::blockSize});
      weights += weight;
    }
  for (PlainTap& tap : taps) tap.weight /= weights;
  return taps;
}

// X_ij between texels.
Eigen::Vector3d lookUp(std::span<const PlainTap> taps, uint32_t light) {
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();
  for (const auto& [weight, block, texel] : taps) {
    const int8_t* e = block->texel(texel);
    const float* a = block->light(light);
    for (int channel = 0; channel < 3; ++channel)
      for (int k = 0; k < block->stride; ++k)
        radiance[channel] += weight * double{a[k]} * e[channel * block->stride + k];
  }
  return radiance;
}

// The nearest point to (x, y) within the texel centres of a stored block.
std::optional<Eigen::Vector2d> nearestTexel(codec::BlockCache& cache, uint32_t view, double x, double y) {
  const codec::ViewFile& file = cache.views()[view];
  const auto clamped = [](double value, int block, int size) {
    return std::clamp(value, block * codec::blockSize + 0.5,
                      std::min((block + 1) * codec::blockSize, size) - 0.5);
  };
  const Eigen::Vector2d from{std::clamp(x, 0.5, file.header().width - 0.5),
                             std::clamp(y, 0.5, file.header().height - 0.5)};
  std::optional<Eigen::Vector2d> nearest;
  for (uint32_t number = 0; number < file.blockCount(); ++number) {
    const codec::BlockPosition block = file.position(number);
    const Eigen::Vector2d here{clamped(from.x(), block.x, file.header().width),
                               clamped(from.y(), block.y, file.header().height)};
    if (!nearest || (here - from).squaredNorm() < (*nearest - from).squaredNorm()) nearest = here;
  }
  return nearest;
}

// A light of the query: directional light, point light or one light of an environment.
struct QueryLight {
  Direction3<AcquisitionSpace> towards;
  Rgb irradiance; // E_q
  weights::LightExtrapolation extrapolation;
  size_t target;        // index among the query's targets, if pairs are blended
  float brightness = 0; // of a light of an environment, before its strength is applied
};

std::vector<QueryLight> lightsOf(const QueryBatch& batch, size_t query) {
  std::vector<QueryLight> lights;
  for (size_t l = 0; l < batch.lights; ++l) {
    const size_t entry = query * batch.lights + l;
    lights.push_back({batch.towardsLight[entry], batch.irradiance[entry], batch.extrapolationOf(l), l});
  }
  for (size_t e = 0; e < batch.environments.size(); ++e) {
    const QueryEnvironment& environment = batch.environments[e];
    for (const auto& [towards, irradiance, spread] : environment.lights)
      lights.push_back({batch.rotationOf(query, e)(towards), environment.strength * irradiance,
                        environment.extrapolation, batch.lights + e, weights::brightness(irradiance)});
  }
  return lights;
}

// Plans the operations of one query after another, without any acceleration.
class PlainPlan {
public:
  PlainPlan(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options)
      : field_(field), batch_(batch), options_(options), how_(lightBlend(field, options)),
        coverage_(weights::lightDirections(field)) {
    plan.places = batch.placeBegin(batch.size());
    const bool hasTables = !isProduct() && usesTables(field, options);
    isProductBeside_ = field.isFullProduct && isSeparateBesideTables(field, options);
    plan.targetsPerPlace =
        (isProduct() || isProductBeside_ ? 1 : batch.sources()) + (hasTables ? batch.lights : 0);
    plan.tablesPerPlace = hasTables ? batch.lights : 0;
    plan.offsets.resize(hasTables ? plan.targets() : 0);
    for (size_t table = 0; hasTables && table < field.shared->tables.count(); ++table)
      nodes_.push_back(field.shared->tables.nodes(table));
    plan.alphaSums.resize(options.usesAlpha && !field.alpha.empty() ? plan.targets() : 0);
  }

  void add(size_t query) {
    surfel_ = batch_.surfels[query];
    p0_ = field_.cloud.p0[surfel_].cast<double>();
    normal_ = assume<Normal3<AcquisitionSpace, double>>(rotationOf<double>(field_.cloud.r0[surfel_]).col(2));
    towardsView_ = batch_.towardsView[query];
    placeBegin_ = batch_.placeBegin(query);
    placeEnd_ = batch_.placeBegin(query + 1);
    float best = weights::kInfinity;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) best = std::min(best, penalty(i, 0));
    plan.confidence.resize(placeEnd_, weights::confidenceOf(best));
    const std::vector<QueryLight> lights = lightsOf(batch_, query);
    if (isProduct()) return addProduct(lights, 0);
    const auto reachedOf = [&](const QueryLight& light) {
      return batch_.reached.empty() ? std::nullopt
                                    : std::optional(batch_.reached[query * batch_.lights + light.target]);
    };
    std::vector<QueryLight> ofProduct;
    for (QueryLight light : lights) {
      const bool isOfEnvironment = light.target >= batch_.lights;
      float rest = 1; // share of the light that tables leave
      if (!plan.offsets.empty() && !isOfEnvironment) {
        const float share = tableShare(light, reachedOf(light));
        if (share > 0) addTables(light, reachedOf(light), share);
        rest -= share;
      }
      if (isProductBeside_ || (field_.isFullProduct && isOfEnvironment)) {
        light.irradiance = rest * light.irradiance;
        ofProduct.push_back(light);
      } else if (isOfEnvironment || !usesKriging(field_, options_) ||
                 isSeparateBesideTables(field_, options_))
        addUlr(light, rest);
      else
        addKriging(light, reachedOf(light), rest);
    }
    if (!ofProduct.empty()) addProduct(ofProduct, isProductBeside_ ? 0 : batch_.lights);
    for (const auto& [target, correction] : corrections_) addCorrection(correction, target);
    corrections_.clear();
  }

  ShadingPlan plan;

private:
  struct Pair {
    uint32_t view, column, light;
  };
  // A pair that kriging may blend.
  struct KrigedPair {
    Pair pair;
    weights::PairPlace place;
    float confidence; // c_ij
    float nugget;     // in addition to nuggetOf
  };

  bool isProduct() const {
    return hasSeparateWeights(field_, options_) ||
           (field_.isFullProduct && batch_.lights == 0 && !correctsEnvironments(field_, batch_, options_));
  }

  std::vector<Pair> pairs() const {
    std::vector<Pair> all;
    for (uint32_t i = 0; i < field_.columns.size(); ++i)
      for (uint32_t column = 0; column < field_.columns[i].size(); ++column)
        all.push_back({i, column, field_.columns[i][column]});
    return all;
  }

  void addProduct(const std::vector<QueryLight>& lights, size_t target) {
    const size_t begin = plan.rows.lights.size();
    if (field_.rig.lights.empty()) plan.rows.add(0, {1, 1, 1}); // fixed illumination
    for (const QueryLight& light : lights)
      for (const auto& [j, u] : lightWeights(light)) plan.rows.add(j, u * ratio(light, j));
    const size_t end = plan.rows.lights.size();
    weights::NearestCandidates views(options_.nearest ? 1 : options_.cameras);
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) views.offer({i, penalty(i, 0)});
    const weights::BlendSet ofViews = truncated(ulrWeights(views), options_.weightError);
    for (const auto& [i, w] : ofViews) emit(target, i, w, begin, end);
    if (plan.offsets.empty()) return;
    for (const QueryLight& light : lights) {
      if (light.target < batch_.lights) continue;
      std::vector<BlendedPair> pairs;
      for (const auto& [j, u] : lightWeights(light))
        for (const auto& [i, w] : ofViews) pairs.push_back({i, j, w * u});
      correctEnvironment(light, blendOf(light), pairs, target);
      for (const auto& [i, w] : ofViews) corrections_[target].views[i].weight = w;
    }
  }

  struct BlendedPair {
    uint32_t view, light;
    float weight;
  };

  // The sums of D (environment_tables.h) of a target.
  struct Correction {
    struct View {
      double weight = 0;
      Eigen::Vector3d taken = Eigen::Vector3d::Zero();
    };
    Eigen::Vector3d lit = Eigen::Vector3d::Zero();
    std::map<uint32_t, View> views;
  };

  // Adds a light of an environment to these sums. u: weights of captured lights without foreshortening;
  // pairs: weights of photographs.
  void correctEnvironment(const QueryLight& source, const weights::BlendSet& u,
                          std::span<const BlendedPair> pairs, size_t target) {
    const auto state = [&](uint32_t j) {
      return field_.lightVisibility
                 ? weights::VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[j])
                 : 1.f;
    };
    const auto reflectance = [&](const Direction3<AcquisitionSpace>& view,
                                 const Direction3<AcquisitionSpace>& light) -> Eigen::Vector3d {
      const SurfelDirection towards = inTables(light);
      return towards.z() > 0 ? predicted(inTables(view), towards).value : Eigen::Vector3d::Zero();
    };
    double weights = 0, cosines = 1e-3, lit = 1e-3; // of V_q
    for (const auto& [j, weight] : u) {
      weights += weight;
      cosines += weight * cosine(j);
      lit += weight * cosine(j) * state(j);
    }
    const double reached =
        std::clamp(weights, 0., 1.) * std::min(1., std::max(1e-3, lit) / std::max(1e-3, cosines));
    const Eigen::Vector3d irradiance(source.irradiance.r, source.irradiance.g, source.irradiance.b);
    Correction& correction = corrections_[target];
    correction.lit += reached * irradiance.cwiseProduct(reflectance(towardsView_, source.towards));
    for (const auto& [i, j, weight] : pairs) {
      const Rgb shown = weights::irradianceRatio({1, 1, 1}, capture::irradianceAt(field_.rig.lights[j], p0_));
      const Eigen::Vector3d mask(shown.r > 0, shown.g > 0, shown.b > 0);
      correction.views[i].taken +=
          weight * state(j) *
          irradiance.cwiseProduct(mask).cwiseProduct(reflectance(towardsView(i), towardsLight(j)));
    }
  }

  // Adds D to a target of all places.
  void addCorrection(const Correction& correction, size_t target) {
    double all = 0;
    for (const auto& [i, view] : correction.views) all += view.weight;
    const double share = tableShare(QueryLight{towardsView_, {}, {}, target}, 1.f);
    for (size_t place = placeBegin_; place < placeEnd_; ++place) {
      const uint32_t surfel = batch_.placeAt(place);
      double looked = 0, shown = 0;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const auto& [i, view] : correction.views) {
        const auto pixel = field_.rig.views[i].camera.project(field_.cloud.p0[surfel].cast<double>());
        if (!pixel) continue;
        looked += view.weight;
        if (!field_.files.empty() &&
            !storesTexel(field_.files[i], static_cast<float>(pixel->x), static_cast<float>(pixel->y)))
          continue;
        shown += view.weight;
        if (field_.visibility.of(surfel)[i] > 0)
          sum += weights::smoothStep(0, 0.2, inTables(towardsView(i)).z()) *
                 (view.weight / all * correction.lit - view.taken);
      }
      if (!(shown > 0)) continue;
      sum *= share * looked / shown;
      Rgb& offset = plan.offsets[place * plan.targetsPerPlace + target];
      offset =
          offset + field_.shared->gains[surfel] * Rgb{static_cast<float>(sum[0]), static_cast<float>(sum[1]),
                                                      static_cast<float>(sum[2])};
    }
  }

  // Weights f_q u_qj.
  weights::BlendSet lightWeights(const QueryLight& source) const {
    std::vector<float> cosines;
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j) cosines.push_back(cosine(j));
    weights::BlendSet u = blendOf(source);
    const float f =
        how_.foreshortened ? weights::foreshortening(cosine(source.towards), blendedCosine(u, cosines)) : 1;
    for (auto& [j, weight] : u) weight *= f;
    return u;
  }

  // Weights u_qj.
  weights::BlendSet blendOf(const QueryLight& source) const {
    std::vector<Direction3<AcquisitionSpace>> towards;
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j) towards.push_back(towardsLight(j));
    const auto beyond = options_.nearest ? weights::LightExtrapolation::clamp : source.extrapolation;
    return blendOfLights(towards, source.towards, how_, coverage_, beyond);
  }

  // Answers a share of a light.
  void addUlr(const QueryLight& source, float answered) {
    const std::vector<Pair> all = pairs();
    weights::NearestCandidates nearest(options_.nearest ? 1 : ulrPairCount(field_, options_));
    for (uint32_t number = 0; number < all.size(); ++number)
      nearest.offer(
          {number, penalty(all[number].view, anglePenalty(towardsLight(all[number].light), source.towards))});
    const float scale = answered * (options_.nearest ? 1 : covered(source));
    weights::BlendSet ofLights;
    std::vector<BlendedPair> blended;
    for (const auto& [number, w] : truncated(ulrWeights(nearest), options_.weightError)) {
      emitPair(source, all[number], w, scale);
      ofLights.push({all[number].light, scale * w});
      blended.push_back({all[number].view, all[number].light, scale * w});
    }
    if (plan.offsets.empty() || source.target < batch_.lights) return;
    correctEnvironment(source, ofLights, blended, source.target);
    for (const auto& [i, j, w] : blended)
      corrections_[source.target].views[i].weight += source.brightness * w;
  }

  // n of all views or lights, by the nearest; 0 for all in a capture with wide gaps.
  std::vector<float> nearnessOf(const weights::NearestCandidates& nearest, size_t count) const {
    std::vector<float> all(count);
    if (field_.hasNearPairs)
      forEachNear(nearest, [&](uint32_t index, float, float nearness) { all[index] = nearness; });
    return all;
  }

  // The photographed pairs. Sets `share` to the share g of the confidence in a pair that need not be near.
  std::vector<KrigedPair> krigedPairs(const QueryLight& source, std::optional<float> reached,
                                      float& share) const {
    weights::NearestCandidates views(weights::kNearSources), lights(weights::kNearSources);
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) views.offer({i, penalty(i, 0)});
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j)
      lights.offer({j, anglePenalty(towardsLight(j), source.towards)});
    const std::vector<float> ofView = nearnessOf(views, field_.rig.views.size()),
                             ofLight = nearnessOf(lights, field_.rig.lights.size());
    const float least = views.sorted().empty() ? weights::kInfinity : views.sorted()[0].penalty;
    const float begun = std::clamp(least - weights::kFallbackFrom, 0.f, 1.f); // fallbacks fade in
    std::vector<float> s;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i)
      s.push_back(
          std::max(seenBy(i), begun * weights::fallbackConfidence(anglePenalty(towardsView(i), towardsView_),
                                                                  penalty(i, 0))));
    float best = 0, photographed = 0;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) {
      for (const float n : ofLight) best = std::max(best, s[i] * ofView[i] * n);
      for (const uint32_t j : field_.columns[i])
        photographed = std::max(photographed, s[i] * ofView[i] * ofLight[j]);
    }
    share = !field_.hasNearPairs ? 1 : best > 0 ? std::max(0.f, 1 - 2 * photographed / best) : 0;
    std::vector<KrigedPair> all;
    for (const Pair& pair : pairs()) {
      const auto& [i, column, j] = pair;
      all.push_back({pair, pairPlace(towardsLight(j), towardsView(i), reachedBy(j, reached), scales(reached)),
                     s[i] * std::max(ofView[i] * ofLight[j], share), 0});
    }
    return all;
  }

  // The photographs of views near the light under lights near the viewer, as pairs with both exchanged.
  std::vector<KrigedPair> exchangedPairs(const QueryLight& source, std::optional<float> reached,
                                         float share) const {
    weights::NearestCandidates lights(weights::kNearSources), views(weights::kNearSources);
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j)
      lights.offer({j, anglePenalty(towardsLight(j), towardsView_)});
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i)
      views.offer({i, anglePenalty(towardsView(i), source.towards) / seenBy(i)});
    const std::vector<float> ofLight = nearnessOf(lights, field_.rig.lights.size()),
                             ofView = nearnessOf(views, field_.rig.views.size());
    std::vector<KrigedPair> all;
    for (const Pair& pair : pairs()) {
      const auto& [i, column, j] = pair;
      all.push_back({pair, pairPlace(towardsView(i), towardsLight(j), 1, scales(reached)),
                     std::max(share, ofView[i] * ofLight[j]) * seenBy(i) *
                         weights::exchangedConfidence(cosine(j), reachedBy(j, reached), reached),
                     weights::kReciprocalNugget});
    }
    return all;
  }

  // The nearest of the pairs as samples with nuggets; the index is that of the pair.
  std::vector<weights::KrigingSample> samplesOf(std::span<const KrigedPair> pairs,
                                                const weights::PairPlace& asked) const {
    const size_t count = pairCount(field_, options_);
    weights::NearestCandidates nearest(count);
    for (uint32_t pair = 0; pair < pairs.size(); ++pair)
      if (pairs[pair].confidence > 0)
        nearest.offer({pair, weights::krigingPenalty(pairs[pair].place, asked) / pairs[pair].confidence});
    const auto sorted = nearest.sorted();
    const float threshold = sorted.size() > count ? sorted.back().penalty : weights::kInfinity;
    std::vector<weights::KrigingSample> samples;
    for (const auto& [pair, p] : sorted.first(std::min(count, sorted.size())))
      samples.push_back({pair, pairs[pair].place,
                         weights::nuggetOf(threshold > 0 ? p / threshold : 0, pairs[pair].confidence) +
                             pairs[pair].nugget});
    return samples;
  }

  // w_ij; the index is that of the pair.
  weights::BlendSet krigingWeights(std::span<const KrigedPair> pairs, const weights::PairPlace& asked) const {
    const std::vector<weights::KrigingSample> samples = samplesOf(pairs, asked);
    const std::vector<double> w = krigingWeightsReference(samples, asked);
    weights::BlendSet blend;
    for (size_t k = 0; k < samples.size(); ++k) blend.push({samples[k].index, static_cast<float>(w[k])});
    return truncated(blend, options_.weightError);
  }

  // Answers a share of a light.
  void addKriging(const QueryLight& source, std::optional<float> reached, float answered) {
    const float state = reached.value_or(1);
    float share = 0;
    std::vector<KrigedPair> pairs = krigedPairs(source, reached, share);
    if (isReciprocal(field_, options_) && state > 0)
      for (const KrigedPair& pair : exchangedPairs(source, reached, share)) pairs.push_back(pair);
    const weights::BlendSet weights =
        krigingWeights(pairs, pairPlace(source.towards, towardsView_, state, scales(reached)));
    float scale = answered * covered(source);
    if (how_.foreshortened) {
      float blended = 0;
      for (const auto& [number, w] : weights) {
        const uint32_t j = pairs[number].pair.light;
        blended += w * reachedBy(j, reached) * cosine(j);
      }
      scale *= weights::foreshortening(state * cosine(source.towards), blended);
    }
    for (const auto& [number, w] : weights) emitPair(source, pairs[number].pair, w, scale);
  }

  using SurfelDirection = Direction3<reflectance::SurfelSpace, double>;

  // A direction in the frame of the tables.
  SurfelDirection inTables(const Direction3<AcquisitionSpace>& direction) const {
    const reflectance::SurfelFrame frame(rotationOf<float>(field_.cloud.r0[surfel_]));
    const Mat3<float> acquisitionFromTables = field_.shared->frameOf(surfel_, frame).matrix();
    return assume<SurfelDirection>(
        Vec3<double>(acquisitionFromTables.transpose().cast<double>() * direction.raw().cast<double>()));
  }

  // A photograph or request as the tables see it.
  struct Predicted {
    Eigen::Vector3d value; // reflectance, without gain
    double cosLight, cosView;
  };
  Predicted predicted(const SurfelDirection& view, const SurfelDirection& light) const {
    const reflectance::TableMixture& mixture = field_.shared->mixtures[surfel_];
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (size_t m = 0; m < reflectance::kMixedTables; ++m) {
      const auto value = lookUpReference(field_.shared->tables.grid, nodes_[mixture.table[m]],
                                         reflectance::halfDifference(view, light));
      sum += mixture.weight[m] * Eigen::Map<const Eigen::Vector3d>(value.data()).cwiseMax(0);
    }
    return {reflectance::tableLink(light.z(), view.z()) * sum, light.z(), view.z()};
  }
  // Mean of the channels, with gain.
  double meanOf(const Predicted& prediction) const {
    const auto& [r, g, b] = field_.shared->gains[surfel_];
    return prediction.value.cwiseProduct(Eigen::Vector3d(r, g, b)).mean();
  }
  // s (correction.h)
  double errorScale(const Predicted& prediction) const {
    return 0.05 * field_.shared->white * std::max(prediction.cosLight, 0.15) + meanOf(prediction);
  }
  // Additional nugget, before the factor 1 - M (shared_weights.h).
  double distrust(const Predicted& prediction) const {
    const auto slope = [](double cosine) { return std::clamp(cosine / 0.3, 1e-3, 1.0); };
    const double u = meanOf(prediction);
    return 2 * u / (u + 0.3 * field_.shared->white) +
           0.1 * (1 / (slope(prediction.cosLight) * slope(prediction.cosView)) - 1);
  }

  // m
  float tableShare(const QueryLight& source, std::optional<float> reached) const {
    const reflectance::SharedReflectance& shared = *field_.shared;
    const reflectance::TableMixture& mixture = shared.mixtures[surfel_];
    double trust = 0;
    for (size_t m = 0; m < reflectance::kMixedTables; ++m)
      trust += mixture.weight[m] * shared.trust[mixture.table[m]];
    const double lit = reached ? *reached : weights::terminatorFade(inTables(source.towards).z());
    return static_cast<float>(trust * lit * weights::smoothStep(0, 0.2, inTables(towardsView_).z()));
  }

  // Photographs that may correct the tables.
  std::vector<KrigedPair> litPairs(const QueryLight& source, std::optional<float> reached) const {
    float share = 0;
    std::vector<KrigedPair> pairs = krigedPairs(source, reached, share);
    for (KrigedPair& pair : pairs) {
      const auto& [i, column, j] = pair.pair;
      pair.place = pairPlace(towardsLight(j), towardsView(i), 1, weights::kResidualScales);
      pair.confidence *= 1 - std::max(0.f, reached.value_or(1) - reachedBy(j, 1.f));
    }
    return pairs;
  }

  // Adds a share m of a light's answer, by tables and the photographs that correct them.
  void addTables(const QueryLight& source, std::optional<float> reached, float share) {
    share *= covered(source);
    const weights::PairPlace asked = pairPlace(source.towards, towardsView_, 1, weights::kResidualScales);
    const std::vector<KrigedPair> pairs = litPairs(source, reached);
    std::vector<weights::KrigingSample> samples = samplesOf(pairs, asked);
    std::vector<Predicted> predictions;
    for (weights::KrigingSample& sample : samples) {
      const auto& [i, column, j] = pairs[sample.index].pair;
      predictions.push_back(predicted(inTables(towardsView(i)), inTables(towardsLight(j))));
      const double near = weights::matern52(double{weights::squaredDistance(sample.place, asked)});
      sample.nugget += static_cast<float>((1 - near) * distrust(predictions.back()));
    }
    const std::vector<double> w = simpleKrigingWeightsReference(samples, asked);
    const Predicted own = predicted(inTables(towardsView_), inTables(source.towards));
    const auto targetAt = [&](size_t place) {
      return (place + 1) * plan.targetsPerPlace - plan.tablesPerPlace + source.target;
    };
    const auto add = [&](size_t place, const Eigen::Vector3d& value) {
      const Rgb reflectance{static_cast<float>(value[0]), static_cast<float>(value[1]),
                            static_cast<float>(value[2])};
      Rgb& sum = plan.offsets[targetAt(place)];
      sum = sum + share * field_.shared->gains[batch_.placeAt(place)] * (source.irradiance * reflectance);
    };
    for (size_t place = placeBegin_; place < placeEnd_; ++place) add(place, own.value);
    for (size_t k = 0; k < samples.size(); ++k) {
      const Pair& pair = pairs[samples[k].index].pair;
      const double scaled = errorScale(own) / errorScale(predictions[k]),
                   factor = std::min(scaled, double{reflectance::kMostScaled}) * w[k];
      if (factor == 0) continue;
      plan.rows.add(pair.column, (factor < 0 ? -share : share) * ratio(source, pair.light));
      const auto row = static_cast<uint32_t>(plan.rows.lights.size() - 1);
      for (size_t place = placeBegin_; place < placeEnd_; ++place) {
        const auto pixel =
            field_.rig.views[pair.view].camera.project(field_.cloud.p0[batch_.placeAt(place)].cast<double>());
        const auto x = static_cast<float>(pixel ? pixel->x : 0), y = static_cast<float>(pixel ? pixel->y : 0);
        if (!pixel || !storesTexel(field_.files[pair.view], x, y))
          continue; // as if it agreed with the tables
        add(place, -factor * predictions[k].value);
        plan.ops.push_back({static_cast<uint32_t>(targetAt(place)), pair.view, x, y,
                            static_cast<float>(std::abs(factor)), row, row + 1});
      }
    }
  }

  // p_i; with pairs, p_i + 1 - cos theta_qj.
  float penalty(size_t i, float ofLight) const {
    const capture::Camera<AcquisitionSpace>& camera = field_.rig.views[i].camera;
    const auto towards = capture::Viewpoint(camera).towards(p0_);
    const float angle = anglePenalty(towards.cast<float>(), towardsView_), s = seenBy(i);
    float p = weights::kInfinity;
    if (s > 0) p = (options_.nearest ? angle : angle / s) + ofLight;
    const auto pixel = camera.project(p0_);
    if (!pixel || !capture::contains(camera.lens, *pixel)) return p;
    const float scale =
        weights::fallbackScale(dot(normal_, towards), weights::borderFade(camera.lens, *pixel), s);
    return std::min(p, weights::fallbackPenalty(angle + ofLight, scale));
  }
  // c_q
  float covered(const QueryLight& source) const {
    float least = weights::kInfinity;
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j)
      least = std::min(least, anglePenalty(towardsLight(j), source.towards));
    return source.extrapolation == weights::LightExtrapolation::fade ? coverage_.at(least) : 1;
  }

  float seenBy(size_t i) const {
    return weights::VisibilityWeights::decode(field_.visibility.of(surfel_)[i]);
  }
  // Part of a captured light that reached the surfel; 1 if shadow states are not used.
  float reachedBy(uint32_t j, std::optional<float> asked) const {
    return asked ? weights::VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[j]) : 1;
  }
  weights::KrigingScales scales(std::optional<float> reached) const {
    return weights::scalesFor(field_.interpolation.halfScale, reached.value_or(1));
  }
  Direction3<AcquisitionSpace> towardsLight(uint32_t j) const {
    return capture::towardsLight(field_.rig.lights[j], p0_).cast<float>();
  }
  Direction3<AcquisitionSpace> towardsView(uint32_t i) const {
    return capture::Viewpoint(field_.rig.views[i].camera).towards(p0_).cast<float>();
  }
  float cosine(const Direction3<AcquisitionSpace>& towards) const {
    return static_cast<float>(weights::foreshortenedCosine(normal_, towards.cast<double>()));
  }
  float cosine(uint32_t j) const {
    return static_cast<float>(
        weights::foreshortenedCosine(normal_, capture::towardsLight(field_.rig.lights[j], p0_)));
  }
  // Irradiance ratio E_q / E_j.
  Rgb ratio(const QueryLight& source, size_t j) const {
    return weights::irradianceRatio(source.irradiance, capture::irradianceAt(field_.rig.lights[j], p0_));
  }

  void emitPair(const QueryLight& source, const Pair& pair, float weight, float scale) {
    plan.rows.add(pair.column, scale * ratio(source, pair.light));
    emit(source.target, pair.view, weight, plan.rows.lights.size() - 1, plan.rows.lights.size());
  }
  // Looks up all places of the query, for a target of each.
  void emit(size_t target, uint32_t view, float weight, size_t begin, size_t end) {
    for (size_t place = placeBegin_; place < placeEnd_; ++place) {
      const auto pixel =
          field_.rig.views[view].camera.project(field_.cloud.p0[batch_.placeAt(place)].cast<double>());
      if (!pixel) continue;
      const auto x = static_cast<float>(pixel->x), y = static_cast<float>(pixel->y);
      const size_t of = place * plan.targetsPerPlace + target;
      float alpha = 1;
      if (!plan.alphaSums.empty()) {
        alpha = field_.alpha[view].at(x, y);
        plan.alphaSums[of].alpha += weight * alpha;
        plan.alphaSums[of].weight += weight;
      }
      if (alpha > 0)
        plan.ops.push_back({static_cast<uint32_t>(of), view, x, y, weight * alpha,
                            static_cast<uint32_t>(begin), static_cast<uint32_t>(end)});
    }
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  const weights::LightBlend how_;
  const weights::LightExtrapolationFade coverage_;
  std::vector<std::vector<Rgb>> nodes_; // of each table
  bool isProductBeside_ = false;        // cameras and lights apart where tables do not answer
  // State of the current query.
  uint32_t surfel_ = 0;
  Point3<AcquisitionSpace, double> p0_;
  Normal3<AcquisitionSpace, double> normal_;
  Direction3<AcquisitionSpace> towardsView_;
  size_t placeBegin_ = 0, placeEnd_ = 0;
  std::map<size_t, Correction> corrections_; // of its targets
};

} // namespace

ShadingPlan planReference(const ReflectanceField& field, const QueryBatch& batch,
                          const ShadeOptions& options) {
  PlainPlan plain(field, batch, options);
  for (size_t query = 0; query < batch.size(); ++query) plain.add(query);
  meanAlpha(plain.plan);
  return std::move(plain.plan);
}

std::vector<Eigen::Vector3d> shadeReference(const ShadingPlan& plan, codec::BlockCache& cache) {
  const auto ofTargets = executeReference(plan.ops, plan.rows, plan.targets(), cache);
  std::vector<Eigen::Vector3d> radiance(plan.places, Eigen::Vector3d::Zero());
  for (size_t target = 0; target < ofTargets.size(); ++target) {
    Eigen::Vector3d sum = ofTargets[target];
    if (!plan.offsets.empty()) {
      const auto& [r, g, b] = plan.offsets[target];
      sum = (sum + Eigen::Vector3d(r, g, b)).cwiseMax(0);
    }
    radiance[target / plan.targetsPerPlace] += sum;
  }
  return radiance;
}

std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const weights::LightRows& rows,
                                              size_t targets, codec::BlockCache& cache) {
  std::vector<Eigen::Vector3d> radiance(targets, Eigen::Vector3d::Zero());
  std::vector<double> all(targets), kept(targets);
  std::vector<bool> isBlind(targets, true); // shows only background
  for (const ShadingOp& op : ops) {
    all[op.target] += op.weight;
    if (holdsTexel(cache, op.view, op.x, op.y)) isBlind[op.target] = false;
  }
  for (const ShadingOp& op : ops) {
    Eigen::Vector2d place(op.x, op.y);
    if (isBlind[op.target]) place = nearestTexel(cache, op.view, op.x, op.y).value_or(place);
    const std::vector<PlainTap> taps = tapsAt(cache, op.view, place.x(), place.y());
    if (taps.empty()) continue;
    kept[op.target] += op.weight;
    for (uint32_t i = op.rowBegin; i < op.rowEnd; ++i) {
      const auto& [color, begin, end] = rows.lights[i];
      const Eigen::Vector3d omega = op.weight * Eigen::Vector3d(color.r, color.g, color.b);
      for (const auto& [light, weight] : std::span(rows.weights).subspan(begin, end - begin))
        radiance[op.target] += weight * omega.cwiseProduct(lookUp(taps, light));
    }
  }
  for (size_t target = 0; target < targets; ++target)
    if (kept[target] != 0) radiance[target] *= all[target] / kept[target];
  return radiance;
}

bool holdsTexel(codec::BlockCache& cache, uint32_t view, double x, double y) {
  return !tapsAt(cache, view, x, y).empty();
}

} // namespace surflect::shading
