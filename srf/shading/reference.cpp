// Symbols: p0 place of the surfel; X_ij reflectance image of view i and captured light j, x_i projection of
// p0 in view i; theta_i angle at p0 between view i and the viewer, theta_qj between light q of the query and
// captured light j; s_i visibility weight of view i; E_q irradiance of light q, E_j of captured light j.
//
//   p_i = (1 - cos theta_i) / s_i        penalty of a view, or its penalty as a fallback if less
//   w_i = ULR(p)_i                       weight of a view                       [Weyrich 2005, §5.2]
//   u_qj = ULR(1 - cos theta_q)_j        weight of a captured light             [Weyrich 2005, §5.2]
//   w_j = sum_q f_q u_qj E_q / E_j       f_q: foreshortening
//   L = sum_i w_i sum_j w_j X_ij(x_i)    radiance
//
// With a weight error, w_i, u_qj and the weights of pairs are truncated (ulr/weight_truncation.h).
//
// Under pairs and kriging, with w_ij as in pair_weights.h:
//   L = sum_q f_q sum_ij w_ij E_q / E_j X_ij(x_i)
//
// Otherwise, a capture with gaps has weights of pairs:
//   L = sum_q sum_ij ULR(p_i + 1 - cos theta_qj)_ij E_q / E_j X_ij(x_i).
#include "srf/shading/reference.h"

#include "srf/shading/light_weights.h"
#include "srf/shading/pair_weights.h"
#include "srf/ulr/fallback_view.h"
#include "srf/ulr/foreshortening.h"
#include "srf/ulr/weight_truncation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::shading {

namespace {

// X_ij at one texel; empty if the texel is background.
std::optional<Eigen::Vector3d> texelRadiance(codec::BlockCache& cache, uint32_t view, uint32_t light, int x,
                                             int y) {
  const std::optional<uint32_t> number =
      cache.views()[view].find({x / codec::blockSize, y / codec::blockSize});
  if (!number) return std::nullopt;
  const std::shared_ptr<const codec::Block> block = cache.get(view, *number);
  const int8_t* e = block->texel(y % codec::blockSize * codec::blockSize + x % codec::blockSize);
  const float* a = block->light(light);
  Eigen::Vector3d radiance = Eigen::Vector3d::Zero();
  for (int channel = 0; channel < 3; ++channel)
    for (int k = 0; k < block->stride; ++k)
      radiance[channel] += double{a[k]} * e[channel * block->stride + k];
  return radiance;
}

// X_ij between texels, bilinear; empty if all four texels are background.
std::optional<Eigen::Vector3d> lookUp(codec::BlockCache& cache, uint32_t view, uint32_t light, double x,
                                      double y) {
  const codec::ViewHeader& header = cache.views()[view].header();
  const double left = std::floor(x - 0.5), top = std::floor(y - 0.5);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weights = 0;
  for (const double tx : {left, left + 1}) {
    for (const double ty : {top, top + 1}) {
      const double weight = (1 - std::abs(x - 0.5 - tx)) * (1 - std::abs(y - 0.5 - ty));
      if (weight == 0) continue;
      const auto radiance =
          texelRadiance(cache, view, light, static_cast<int>(std::clamp<double>(tx, 0, header.width - 1)),
                        static_cast<int>(std::clamp<double>(ty, 0, header.height - 1)));
      if (!radiance) continue;
      sum += weight * *radiance;
      weights += weight;
    }
  }
  if (weights == 0) return std::nullopt;
  return Eigen::Vector3d(sum / weights);
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
  ulr::LightExtrapolation extrapolation;
  size_t target; // index among the query's targets, if pairs are blended
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
                        environment.extrapolation, batch.lights + e});
  }
  return lights;
}

// Plans the operations of one query after another, without any acceleration.
class PlainPlan {
public:
  PlainPlan(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options)
      : field_(field), batch_(batch), options_(options), how_(lightBlend(field, options)),
        coverage_(lightDirections(field)) {}

  size_t targetsPerPlace() const { return isProduct() ? 1 : batch_.sources(); }

  void add(size_t query) {
    const uint32_t surfel = batch_.surfels[query];
    surfel_ = surfel;
    p0_ = field_.cloud.p0[surfel].cast<double>();
    normal_ = assume<Normal3<AcquisitionSpace, double>>(rotationOf<double>(field_.cloud.r0[surfel]).col(2));
    visibility_ = field_.visibility.of(surfel);
    towardsView_ = batch_.towardsView[query];
    placeBegin_ = batch_.placeBegin(query);
    placeEnd_ = batch_.placeBegin(query + 1);
    const std::vector<QueryLight> lights = lightsOf(batch_, query);
    if (isProduct()) return addProduct(lights, 0);
    std::vector<QueryLight> ofEnvironments;
    for (const QueryLight& light : lights) {
      if (field_.isFullProduct && light.target >= batch_.lights)
        ofEnvironments.push_back(light);
      else if (!weighsPairs(field_, options_) || light.target >= batch_.lights)
        addPairs(light);
      else
        addNearPairs(light, !batch_.reached.empty()
                                ? std::optional(batch_.reached[query * batch_.lights + light.target])
                                : std::nullopt);
    }
    if (!ofEnvironments.empty()) addProduct(ofEnvironments, batch_.lights);
  }

  std::vector<ShadingOp> ops;
  LightRows rows;

private:
  bool isProduct() const {
    return hasSeparateWeights(field_, options_) || (field_.isFullProduct && batch_.lights == 0);
  }

  void addProduct(const std::vector<QueryLight>& lights, size_t target) {
    const size_t begin = rows.lights.size();
    if (field_.rig.lights.empty()) rows.add(0, {1, 1, 1}); // fixed illumination
    for (const QueryLight& light : lights)
      for (const auto& [j, u] : lightWeights(light)) rows.add(j, u * ratio(light, j));
    const size_t end = rows.lights.size();
    ulr::NearestCandidates views(options_.nearest ? 1 : options_.cameras);
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) views.offer({i, penalty(i, 0)});
    for (const auto& [i, w] : truncated(ulr::ulrWeights(views))) emit(target, i, w, begin, end);
  }

  void addPairs(const QueryLight& source) {
    struct Pair {
      uint32_t view, column, light;
    };
    std::vector<Pair> pairs;
    ulr::NearestCandidates nearest(options_.nearest ? 1 : pairCount(field_, options_));
    float least = std::numeric_limits<float>::infinity();
    for (const capture::Light& light : field_.rig.lights)
      least = std::min(least, lightPenalty(light, source));
    for (uint32_t i = 0; i < field_.columns.size(); ++i)
      for (uint32_t column = 0; column < field_.columns[i].size(); ++column) {
        const uint32_t j = field_.columns[i][column];
        nearest.offer(
            {static_cast<uint32_t>(pairs.size()), penalty(i, lightPenalty(field_.rig.lights[j], source))});
        pairs.push_back({i, column, j});
      }
    const bool visibility = source.extrapolation == ulr::LightExtrapolation::fade && !options_.nearest;
    const float covered = visibility ? coverage_.at(least) : 1;
    for (const auto& [number, w] : truncated(ulr::ulrWeights(nearest))) {
      const auto& [i, column, j] = pairs[number];
      rows.add(column, covered * ratio(source, j));
      emit(source.target, i, w, rows.lights.size() - 1, rows.lights.size());
    }
  }

  // n of the nearest views or lights, 0 for the others and in a capture with wide gaps (pair_weights.h).
  std::vector<float> nearness(const ulr::NearestCandidates& nearest, size_t count) const {
    std::vector<float> all(count);
    if (!field_.hasNearPairs) return all;
    const auto sorted = nearest.sorted();
    for (const auto& [index, p] : sorted.first(std::min(kNearSources, sorted.size()))) {
      const float threshold = ulr::thresholdPenalty(sorted, kNearSources);
      all[index] = sorted[0].penalty < threshold ? std::clamp((1 - p / threshold) / (1 - kNearUpTo), 0.f, 1.f)
                   : p <= sorted[0].penalty      ? 1.f
                                                 : 0.f;
    }
    return all;
  }

  // Part of a captured light that reached the surfel; 1 if shadow states are not used.
  float reachedBy(uint32_t j, std::optional<float> asked) const {
    return asked ? ulr::VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[j]) : 1;
  }

  struct NearPair {
    uint32_t view, column, light;
    ulr::PairPlace place;
    float confidence; // c_ij
    float nugget;     // in addition to nuggetOf
  };

  // Pairs of the nearest views and lights, and the part of all others that a gap needs (pair_weights.h).
  std::vector<NearPair> nearPairs(const ulr::NearestCandidates& views, const ulr::NearestCandidates& lights,
                                  std::optional<float> reached, float& share) const {
    const std::vector<float> ofView = nearness(views, field_.rig.views.size()),
                             ofLight = nearness(lights, field_.rig.lights.size());
    const bool needsFallbacks = views.sorted().empty() || views.sorted()[0].penalty > ulr::kFallbackFrom;
    const float begun = needsFallbacks && !views.sorted().empty()
                            ? std::min(1.f, views.sorted()[0].penalty - ulr::kFallbackFrom)
                            : 1;
    std::vector<float> s;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) {
      const float angle = ulr::anglePenalty(towardsView(i), towardsView_);
      s.push_back(std::max(ulr::VisibilityWeights::decode(visibility_[i]),
                           needsFallbacks ? begun * ulr::fallbackConfidence(angle, penalty(i, 0)) : 0));
    }
    float best = 0, photographed = 0;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) {
      for (const float n : ofLight) best = std::max(best, s[i] * ofView[i] * n);
      for (const uint32_t j : field_.columns[i])
        photographed = std::max(photographed, s[i] * ofView[i] * ofLight[j]);
    }
    share = !field_.hasNearPairs ? 1 : best > 0 ? std::max(0.f, 1 - 2 * photographed / best) : 0;
    std::vector<NearPair> pairs;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i)
      for (uint32_t column = 0; column < field_.columns[i].size(); ++column) {
        const uint32_t j = field_.columns[i][column];
        if (const float confidence = s[i] * std::max(ofView[i] * ofLight[j], share); confidence > 0)
          pairs.push_back({i, column, j,
                           ulr::pairPlace(towardsLight(j), towardsView(i), reachedBy(j, reached),
                                          scalesOf(field_, options_, reached.value_or(1))),
                           confidence, 0});
      }
    return pairs;
  }

  // The photographs of views near the light under lights near the viewer, as pairs with both exchanged.
  std::vector<NearPair> exchangedPairs(const QueryLight& source, std::optional<float> requested,
                                       float share) const {
    ulr::NearestCandidates lights(kNearSources), views(kNearSources);
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j)
      lights.offer({j, ulr::anglePenalty(towardsLight(j), towardsView_)});
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i)
      views.offer({i, ulr::anglePenalty(towardsView(i), source.towards) /
                          ulr::VisibilityWeights::decode(visibility_[i])});
    const std::vector<float> ofLight = nearness(lights, field_.rig.lights.size()),
                             ofView = nearness(views, field_.rig.views.size());
    std::vector<NearPair> pairs;
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i)
      for (uint32_t column = 0; column < field_.columns[i].size(); ++column) {
        const uint32_t j = field_.columns[i][column];
        const float confidence =
            std::max(share, ofView[i] * ofLight[j]) * ulr::VisibilityWeights::decode(visibility_[i]) *
            exchangedConfidence(static_cast<float>(ulr::foreshortenedCosine(
                                    normal_, capture::towardsLight(field_.rig.lights[j], p0_))),
                                requested.value_or(1) * reachedBy(j, requested));
        if (confidence > 0)
          pairs.push_back({i, column, j,
                           ulr::pairPlace(towardsView(i), towardsLight(j), 1,
                                          scalesOf(field_, options_, requested.value_or(1))),
                           confidence, kReciprocalNugget});
      }
    return pairs;
  }

  Direction3<AcquisitionSpace> towardsLight(uint32_t j) const {
    return capture::towardsLight(field_.rig.lights[j], p0_).cast<float>();
  }
  Direction3<AcquisitionSpace> towardsView(uint32_t i) const {
    return capture::Viewpoint(field_.rig.views[i].camera).towards(p0_).cast<float>();
  }

  // w_ij; the index is that of the pair.
  ulr::BlendSet nearWeights(const std::vector<NearPair>& pairs, const ulr::PairPlace& asked) const {
    const bool isKriging = interpolationOf(field_, options_) == Interpolation::kriging;
    const size_t count = pairCount(field_, options_);
    ulr::NearestCandidates nearest(count);
    for (uint32_t pair = 0; pair < pairs.size(); ++pair) {
      const float apart = std::abs(pairs[pair].place.back() - asked.back()),
                  squared = std::max(0.f, ulr::squaredDistance(pairs[pair].place, asked) - apart * apart);
      nearest.offer({pair, (isKriging ? krigingPenalty(squared, apart) : pairPenalty(squared, apart)) /
                               pairs[pair].confidence});
    }
    if (!isKriging) return truncated(ulr::ulrWeights(nearest));
    const auto sorted = nearest.sorted();
    std::vector<ulr::KrigingSample> samples;
    for (const auto& [pair, distance] : sorted.first(std::min(count, sorted.size())))
      samples.push_back(
          {pair, pairs[pair].place,
           ulr::nuggetOf(sorted.size() > count && sorted.back().penalty > 0 ? distance / sorted.back().penalty
                                                                            : 0,
                         pairs[pair].confidence) +
               pairs[pair].nugget});
    const std::vector<double> w = ulr::krigingWeightsReference(samples, asked);
    ulr::BlendSet weights;
    for (size_t k = 0; k < samples.size(); ++k) weights.push({samples[k].index, static_cast<float>(w[k])});
    return truncated(weights);
  }

  void addNearPairs(const QueryLight& source, std::optional<float> reached) {
    ulr::NearestCandidates views(kNearSources), lights(kNearSources);
    for (uint32_t i = 0; i < field_.rig.views.size(); ++i) views.offer({i, penalty(i, 0)});
    for (uint32_t j = 0; j < field_.rig.lights.size(); ++j)
      lights.offer({j, lightPenalty(field_.rig.lights[j], source)});
    float share = 0;
    std::vector<NearPair> pairs = nearPairs(views, lights, reached, share);
    if (isReciprocal(field_, options_) && reached.value_or(1) > 0)
      for (const NearPair& pair : exchangedPairs(source, reached, share)) pairs.push_back(pair);
    const ulr::BlendSet weights =
        nearWeights(pairs, ulr::pairPlace(source.towards, towardsView_, reached.value_or(1),
                                          scalesOf(field_, options_, reached.value_or(1))));
    float scale =
        source.extrapolation == ulr::LightExtrapolation::fade ? coverage_.at(lights.sorted()[0].penalty) : 1;
    if (how_.foreshortened) {
      double blended = 0;
      for (const auto& [pair, w] : weights) {
        const uint32_t j = pairs[pair].light;
        blended += w * reachedBy(j, reached) *
                   ulr::foreshortenedCosine(normal_, capture::towardsLight(field_.rig.lights[j], p0_));
      }
      const double asked =
          reached.value_or(1) * ulr::foreshortenedCosine(normal_, source.towards.cast<double>());
      scale *= ulr::foreshortening(static_cast<float>(asked), static_cast<float>(blended));
    }
    for (const auto& [pair, w] : weights) {
      rows.add(pairs[pair].column, scale * ratio(source, pairs[pair].light));
      emit(source.target, pairs[pair].view, w, rows.lights.size() - 1, rows.lights.size());
    }
  }

  ulr::BlendSet truncated(ulr::BlendSet weights) const {
    ulr::truncate(weights, options_.weightError);
    return weights;
  }

  // p_i; with pairs, p_i + 1 - cos theta_qj.
  float penalty(size_t i, float ofLight) const {
    const capture::Camera<AcquisitionSpace>& camera = field_.rig.views[i].camera;
    const auto towards = capture::Viewpoint(camera).towards(p0_);
    const float angle = ulr::anglePenalty(towards.cast<float>(), towardsView_),
                s = ulr::VisibilityWeights::decode(visibility_[i]);
    float p = std::numeric_limits<float>::infinity();
    if (s > 0) p = (options_.nearest ? angle : angle / s) + ofLight;
    const auto pixel = camera.project(p0_);
    if (!pixel || !capture::contains(camera.lens, *pixel)) return p;
    const float scale = ulr::fallbackScale(dot(normal_, towards), ulr::borderFade(camera.lens, *pixel), s);
    return std::min(p, ulr::fallbackPenalty(angle + ofLight, scale));
  }

  // Weights f_q u_qj.
  ulr::BlendSet lightWeights(const QueryLight& source) const {
    std::vector<Direction3<AcquisitionSpace>> towards;
    std::vector<double> cosines;
    for (const capture::Light& light : field_.rig.lights) {
      towards.push_back(capture::towardsLight(light, p0_).cast<float>());
      cosines.push_back(ulr::foreshortenedCosine(normal_, capture::towardsLight(light, p0_)));
    }
    const ulr::LightExtrapolation beyond =
        options_.nearest ? ulr::LightExtrapolation::clamp : source.extrapolation;
    ulr::BlendSet u = ulr::blendOfLights(towards, source.towards, how_, coverage_, beyond);
    if (!how_.foreshortened) return u;
    std::vector<float> blended(cosines.begin(), cosines.end());
    const auto asked = static_cast<float>(ulr::foreshortenedCosine(normal_, source.towards.cast<double>()));
    const float f = ulr::foreshortening(asked, ulr::blendedCosine(u, blended));
    for (auto& [j, weight] : u) weight *= f;
    return u;
  }

  float lightPenalty(const capture::Light& light, const QueryLight& source) const {
    return ulr::anglePenalty(capture::towardsLight(light, p0_).cast<float>(), source.towards);
  }
  // Irradiance ratio E_q / E_j.
  Rgb ratio(const QueryLight& source, size_t j) const {
    return irradianceRatio(source.irradiance, capture::irradianceAt(field_.rig.lights[j], p0_));
  }
  // Looks up all places of the query, for a target of each.
  void emit(size_t target, uint32_t view, float weight, size_t begin, size_t end) {
    for (size_t place = placeBegin_; place < placeEnd_; ++place)
      if (const auto pixel =
              field_.rig.views[view].camera.project(field_.cloud.p0[batch_.placeAt(place)].cast<double>())) {
        const auto x = static_cast<float>(pixel->x), y = static_cast<float>(pixel->y);
        const float alpha = options_.usesAlpha && !field_.alpha.empty() ? field_.alpha[view].at(x, y) : 1;
        ops.push_back({static_cast<uint32_t>(place * targetsPerPlace() + target), view, x, y, weight * alpha,
                       static_cast<uint32_t>(begin), static_cast<uint32_t>(end)});
      }
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  const ulr::LightBlend how_;
  const ulr::LightExtrapolationFade coverage_;
  // State of the current query.
  uint32_t surfel_ = 0;
  Point3<AcquisitionSpace, double> p0_;
  Normal3<AcquisitionSpace, double> normal_;
  std::span<const uint8_t> visibility_;
  Direction3<AcquisitionSpace> towardsView_;
  size_t placeBegin_ = 0, placeEnd_ = 0;
};

} // namespace

std::vector<Eigen::Vector3d> shadeReference(const ReflectanceField& field, const QueryBatch& batch,
                                            const ShadeOptions& options, codec::BlockCache& cache) {
  PlainPlan plan(field, batch, options);
  for (size_t query = 0; query < batch.size(); ++query) plan.add(query);
  const size_t targets = plan.targetsPerPlace(), places = batch.placeBegin(batch.size());
  const auto ofTargets = executeReference(plan.ops, plan.rows, places * targets, cache);
  std::vector<Eigen::Vector3d> radiance(places, Eigen::Vector3d::Zero());
  for (size_t target = 0; target < ofTargets.size(); ++target)
    radiance[target / targets] += ofTargets[target];
  return radiance;
}

std::vector<Eigen::Vector3d> executeReference(std::span<const ShadingOp> ops, const LightRows& rows,
                                              size_t targets, codec::BlockCache& cache) {
  std::vector<Eigen::Vector3d> radiance(targets, Eigen::Vector3d::Zero());
  std::vector<double> all(targets), kept(targets);
  const auto add = [&](const ShadingOp& op, double x, double y) {
    if (!lookUp(cache, op.view, 0, x, y)) return;
    kept[op.target] += op.weight;
    for (uint32_t i = op.rowBegin; i < op.rowEnd; ++i) {
      const auto& [color, begin, end] = rows.lights[i];
      const Eigen::Vector3d omega = op.weight * Eigen::Vector3d(color.r, color.g, color.b);
      for (const auto& [light, weight] : std::span(rows.weights).subspan(begin, end - begin))
        radiance[op.target] += weight * omega.cwiseProduct(*lookUp(cache, op.view, light, x, y));
    }
  };
  std::vector<bool> isBlind(targets, true);
  for (const ShadingOp& op : ops) {
    all[op.target] += op.weight;
    if (lookUp(cache, op.view, 0, op.x, op.y)) isBlind[op.target] = false;
  }
  for (const ShadingOp& op : ops) {
    if (!isBlind[op.target])
      add(op, op.x, op.y);
    else if (const auto texel = nearestTexel(cache, op.view, op.x, op.y))
      add(op, texel->x(), texel->y());
  }
  for (size_t target = 0; target < targets; ++target)
    if (kept[target] != 0) radiance[target] *= all[target] / kept[target];
  return radiance;
}

bool holdsTexel(codec::BlockCache& cache, uint32_t view, double x, double y) {
  return lookUp(cache, view, 0, x, y).has_value();
}

} // namespace surflect::shading
