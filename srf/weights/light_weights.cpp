#include "srf/weights/light_weights.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <variant>

namespace surflect::weights {

namespace {

// Array of four floats, built in a register: Eigen's constructor stores the numbers one by one, and loading
// them together then stalls for a dozen cycles.
Eigen::Array4f fourFloats(float a, float b, float c, float d) {
  typedef float Four __attribute__((vector_size(16)));
  const Four four{a, b, c, d};
  Eigen::Array4f all;
  std::memcpy(all.data(), &four, sizeof four);
  return all;
}

} // namespace

std::vector<Rgb> blendColors(size_t count) {
  const auto channel = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  std::vector<Rgb> colors;
  for (size_t i = 0; i < count; ++i) {
    const double turns = static_cast<double>(i) * 0.41421356237309515;
    const double hue = 6 * (turns - std::floor(turns));
    colors.push_back(
        {channel(std::abs(hue - 3) - 1), channel(2 - std::abs(hue - 2)), channel(2 - std::abs(hue - 4))});
  }
  return colors;
}

std::vector<float> environmentBrightness(const QueryBatch& batch) {
  std::vector<float> all;
  for (const QueryEnvironment& environment : batch.environments)
    all.push_back(brightness(totalIrradiance(environment.lights)));
  return all;
}

std::vector<Direction3<AcquisitionSpace, double>> lightDirections(const ReflectanceField& field) {
  std::vector<Direction3<AcquisitionSpace, double>> directions;
  for (const capture::Light& light : field.rig.lights)
    directions.push_back(capture::towardsLight(light, field.middle));
  return directions;
}

double lightSpacing(const ReflectanceField& field) {
  return LightExtrapolationFade(lightDirections(field)).spacing();
}

std::optional<LightTable> lightTable(const ReflectanceField& field, const ShadeOptions& options,
                                     LightExtrapolation extrapolation) {
  const auto isDirectional = [](const capture::Light& light) {
    return std::holds_alternative<capture::DirectionalLight>(light.kind);
  };
  if (!field.isFullProduct || !std::ranges::all_of(field.rig.lights, isDirectional)) return std::nullopt;
  return LightTable(lightDirections(field), lightBlend(field, options),
                    options.nearest ? LightExtrapolation::clamp : extrapolation);
}

void LightWeights::Sums::moveTo(LightRows& rows) {
  for (uint32_t word = 0; word < isSet_.size(); ++word) {
    for (uint64_t bits = isSet_[word]; bits != 0; bits &= bits - 1) {
      const auto light = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
      Eigen::Array4f& weight = weights_[light];
      const Rgb rgb{weight[1], weight[2], weight[3]};
      if (rgb != Rgb{}) rows.add(light, rgb);
      weight.setZero();
    }
    isSet_[word] = 0;
  }
}

LightWeights::LightWeights(const ReflectanceField& field, const LightExtrapolationFade& coverage,
                           const QueryBatch& batch, const ShadeOptions& options, LightSources sources)
    : field_(field), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      lightCount_(sources == LightSources::all ? batch.lights : 0), lightBlend_(lightBlend(field, options)),
      hasShortRows_(batch.environments.empty() &&
                    2 * lightCount_ * lightBlend_.lights <= field.rig.lights.size()),
      showsColors_(options.showsBlends), lights_(field.rig.lights),
      ulr_(sourcesOf(viewpointsOf(field.rig.lights)), lightBlend_.weightError), environmentUlr_(ulr_),
      ulrOfLight_(lightCount_),
      canBeGrouped_(hasShortRows_ && lights_.areUniform() && lights_.inverseColor() && !showsColors_),
      sums_(field.rig.lights.size()), lightColor_(blendColors(field.rig.lights.size())),
      environmentBrightness_(environmentBrightness(batch)),
      asksReached_(correctsEnvironments(field, batch, options)), cosine_(field.rig.lights.size()),
      state_(field.rig.lights.size(), 1.f) {
  for (size_t l = 0; l < lightCount_; ++l) canBeGrouped_ &= isPlainUlr(batch.extrapolationOf(l));
  for (const QueryEnvironment& environment : batch.environments) {
    shares_.emplace_back(field.rig.lights.size());
    reached_.emplace_back(asksReached_ ? environment.lights.size() : 0);
    environments_.emplace_back(environment.table ? environment.lights : std::span<const EnvironmentLight>());
  }
}

void LightWeights::prepare(size_t begin, size_t count, LightRows& rows) {
  begin_ = begin;
  count_ = count;
  ulr_.setPlaces({batch_.placesAt(field_.cloud, begin, count).data(), count});
  for (size_t l = 0; l < lightCount_; ++l)
    ulr_.blend({batch_.towardsLightAt(l, begin, count).data(), count}, lightBlend_.lights, ulrOfLight_[l]);
  isGrouped_ = canBeGrouped_ && std::ranges::all_of(ulrOfLight_, &QueryBlends::areAllPrecise);
  if (isGrouped_) appendGroup(rows);
}

LightWeights::Row LightWeights::append(size_t lane, LightRows& rows, bool asksReached) {
  color_ = {};
  asksNow_ = asksReached_ && asksReached;
  if (isGrouped_) return {rowEnds_[lane], rowEnds_[lane + 1]};
  const size_t begin = rows.lights.size(), query = begin_ + lane;
  lights_.moveTo(field_.cloud.p0[batch_.surfels[query]].cast<double>());
  if (lightBlend_.foreshortened || asksNow_) setNormal(batch_.surfels[query]);
  if (asksNow_) setStates(batch_.surfels[query]);
  const float share = 1 / static_cast<float>(batch_.sources());
  for (size_t l = 0; l < lightCount_; ++l) {
    const auto& towards = batch_.towardsLight[query * batch_.lights + l];
    const BlendSet blend = blendOf(ulrOfLight_[l], lane, towards, batch_.extrapolationOf(l));
    if (lightBlend_.foreshortened && batch_.environments.empty())
      for (const auto& [light, weight] : blend)
        cosine_[light] = foreshortenedCosine(normal_, lights_.towards(light));
    const Rgb now = foreshorteningOf(blend, towards) * irradianceOf(query, l);
    for (const auto& [light, weight] : blend) addToBlendColor(light, weight * share);
    if (now == Rgb{}) continue;
    if (hasShortRows_)
      appendLight(now, blend, rows);
    else
      for (const auto& [light, weight] : blend)
        sums_.add(light, weight * lights_.ratio(fourFloats(0, now.r, now.g, now.b), light));
  }
  for (size_t e = 0; e < batch_.environments.size(); ++e) addEnvironment(query, e);
  sums_.moveTo(rows);
  return {begin, rows.lights.size()};
}

// Appends the rows of a whole group, as appendLight would.
void LightWeights::appendGroup(LightRows& rows) {
  size_t next = rows.weights.size();
  rows.weights.resize(next + count_ * lightCount_ * lightBlend_.lights);
  rowEnds_[0] = rows.lights.size();
  for (size_t lane = 0; lane < count_; ++lane) {
    for (size_t l = 0; l < ulrOfLight_.size(); ++l) {
      const QueryBlends& ulr = ulrOfLight_[l];
      assert(ulr.size() == lightBlend_.lights);
      const Rgb& now = irradianceOf(begin_ + lane, l);
      if (now == Rgb{}) continue;
      const auto begin = static_cast<uint32_t>(next);
      for (size_t i = 0; i < ulr.size(); ++i) {
        const uint32_t light = ulr.index(lane, i);
        const float weight = ulr.weight(lane, i);
        rows.weights[next] = {light, weight * lights_.inverseStrength(light)};
        next += weight > 0 ? 1 : 0;
      }
      rows.lights.push_back({*lights_.inverseColor() * now, begin, static_cast<uint32_t>(next)});
    }
    rowEnds_[lane + 1] = rows.lights.size();
  }
  rows.weights.resize(next);
}

// Appends one light of the query: a single BlendedLight, or one for each captured light if their colours
// differ.
void LightWeights::appendLight(const Rgb& now, const BlendSet& blend, LightRows& rows) const {
  const auto begin = static_cast<uint32_t>(rows.weights.size());
  for (const auto& [light, weight] : blend)
    if (lights_.inverseColor()) {
      rows.weights.push_back({light, weight * lights_.inverseStrength(light)});
    } else {
      const Eigen::Array4f ratio = weight * lights_.ratio(fourFloats(0, now.r, now.g, now.b), light);
      rows.add(light, {ratio[1], ratio[2], ratio[3]});
    }
  if (lights_.inverseColor())
    rows.lights.push_back({*lights_.inverseColor() * now, begin, static_cast<uint32_t>(rows.weights.size())});
}

// c_q u_ql of one light; evaluates the blended lights.
BlendSet LightWeights::blendOf(const QueryBlends& ulr, size_t lane,
                               const Direction3<AcquisitionSpace>& towards,
                               LightExtrapolation extrapolation) {
  const LightExtrapolation beyond = nearest_ ? LightExtrapolation::clamp : extrapolation;
  if (!ulr.isPrecise(lane)) { // single precision lost a direction
    lights_.evaluateAll();
    return blendOfLights(lights_.towards(), towards, lightBlend_, coverage_, beyond);
  }
  const BlendSet mean = ulr.of(lane);
  for (const auto& [light, weight] : mean) lights_.evaluate(light);
  return fittedBlend(mean, ulr.penalty(lane), lights_.towards(), towards, lightBlend_, coverage_, beyond);
}

// With environments, also the cosines of all captured lights; else append() finds those that are blended.
void LightWeights::setNormal(uint32_t surfel) {
  normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(field_.cloud.r0[surfel]).col(2));
  if (batch_.environments.empty()) return;
  lights_.evaluateAll();
  for (size_t light = 0; light < cosine_.size(); ++light)
    cosine_[light] = foreshortenedCosine(normal_, lights_.towards(light));
}

void LightWeights::setStates(uint32_t surfel) {
  if (!field_.lightVisibility) return;
  const auto states = field_.lightVisibility->of(surfel);
  for (size_t light = 0; light < state_.size(); ++light)
    state_[light] = VisibilityWeights::decode(states[light]);
}

// Foreshortening f_q.
float LightWeights::foreshorteningOf(const BlendSet& blend,
                                     const Direction3<AcquisitionSpace>& towards) const {
  if (!lightBlend_.foreshortened) return 1;
  return foreshortening(foreshortenedCosine(normal_, towards), blendedCosine(blend, cosine_));
}

// Adds an environment, the sum of its lights: its irradiance is distributed to the captured lights around the
// surfel, then divided by theirs.
void LightWeights::addEnvironment(size_t query, size_t e) {
  const QueryEnvironment& environment = batch_.environments[e];
  if (environment.lights.empty()) return;
  std::vector<Eigen::Array4f>& shares = shares_[e];
  std::ranges::fill(shares, Eigen::Array4f::Zero());
  lights_.evaluateAll();
  shareEnvironment(e, batch_.rotationOf(query, e));
  const Rgb& strength = environment.strength;
  const Eigen::Array4f scale(1 / (environmentBrightness_[e] * static_cast<float>(batch_.sources())),
                             strength.r, strength.g, strength.b);
  for (uint32_t light = 0; light < shares.size(); ++light)
    if (shares[light][3] != 0) { // 0 for all lights if the environment is dark
      const Eigen::Array4f now(shares[light][3], shares[light][0], shares[light][1], shares[light][2]);
      const Eigen::Array4f weight = lights_.ratio(scale * now, light);
      sums_.add(light, weight);
      addToBlendColor(light, weight[0]);
    }
}

void LightWeights::shareEnvironment(size_t e,
                                    const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotation) {
  const QueryEnvironment& environment = batch_.environments[e];
  const Foreshortened surface{normal_, cosine_};
  const ReachedParts reached{cosine_, state_, reached_[e]};
  if (environment.table) {
    environment.table->spread(environments_[e], rotation, shares_[e],
                              lightBlend_.foreshortened ? &surface : nullptr, asksNow_ ? &reached : nullptr);
    return;
  }
  const Point3<AcquisitionSpace> place = lights_.place().cast<float>();
  environmentUlr_.setPlaces({&place, 1});
  std::array<Direction3<AcquisitionSpace>, kQueryLanes> towards;
  for (size_t begin = 0; begin < environment.lights.size(); begin += kQueryLanes) {
    const auto lights =
        environment.lights.subspan(begin, std::min(kQueryLanes, environment.lights.size() - begin));
    for (size_t i = 0; i < lights.size(); ++i) towards[i] = rotation(lights[i].towards);
    environmentUlr_.blend({towards.data(), lights.size()}, lightBlend_.lights, ulrOfEnvironment_);
    for (size_t i = 0; i < lights.size(); ++i) {
      const BlendSet blend = blendOf(ulrOfEnvironment_, i, towards[i], environment.extrapolation);
      const Rgb& irradiance = lights[i].irradiance;
      const Rgb scaled = foreshorteningOf(blend, towards[i]) * irradiance;
      ReachedPart part;
      for (const auto& [light, weight] : blend) {
        shares_[e][light] += weight * Eigen::Array4f(scaled.r, scaled.g, scaled.b, brightness(irradiance));
        part.add(weight, cosine_[light], state_[light]);
      }
      if (asksNow_) reached_[e][begin + i] = part.value();
    }
  }
}

} // namespace surflect::weights
