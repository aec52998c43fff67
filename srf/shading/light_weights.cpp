#include "srf/shading/light_weights.h"

#include "srf/shading/blend_colors.h"
#include "srf/ulr/foreshortening.h"
#include "srf/ulr/light_visibility.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstring>
#include <limits>
#include <variant>

namespace surflect::shading {

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

bool isUniform(const capture::Light& light) {
  const auto* directional = std::get_if<capture::DirectionalLight>(&light.kind);
  return directional && directional->isEven();
}

std::array<double, 3> strengthOf(const capture::Light& light) {
  const auto* directional = std::get_if<capture::DirectionalLight>(&light.kind);
  const Rgb strength =
      directional ? directional->irradiance : std::get<capture::PointLight>(light.kind).intensity;
  return {strength.r, strength.g, strength.b};
}

} // namespace

Rgb irradianceRatio(Rgb now, Rgb captured) {
  const auto divide = [](float a, float b) { return b > 0 ? a / b : 0; };
  return {divide(now.r, captured.r), divide(now.g, captured.g), divide(now.b, captured.b)};
}

std::vector<float> environmentBrightness(const QueryBatch& batch) {
  std::vector<float> all;
  for (const QueryEnvironment& environment : batch.environments)
    all.push_back(brightness(ulr::totalIrradiance(environment.lights)));
  return all;
}

ulr::LightBlend lightBlend(const ReflectanceField& field, const ShadeOptions& options) {
  if (options.nearest) return {1, ulr::LightFit::mean};
  if (options.interpolation == Interpolation::paper)
    return {options.lights.value_or(3), options.lightFit.value_or(ulr::LightFit::mean),
            options.foreshortened.value_or(false), options.weightError};
  return {options.lights.value_or(field.lightBlend.lights), options.lightFit.value_or(field.lightBlend.fit),
          options.foreshortened.value_or(field.lightBlend.foreshortened), options.weightError};
}

Interpolation interpolationOf(const ReflectanceField& field, const ShadeOptions& options) {
  return options.interpolation.value_or(field.interpolation.kind);
}

size_t pairCount(const ReflectanceField& field, const ShadeOptions& options) {
  return options.pairs.value_or(interpolationOf(field, options) == Interpolation::kriging ? 6 : 4);
}

bool weighsPairs(const ReflectanceField& field, const ShadeOptions& options) {
  const Interpolation interpolation = interpolationOf(field, options);
  return !field.rig.lights.empty() && !options.nearest &&
         (interpolation == Interpolation::pairs || interpolation == Interpolation::kriging);
}

bool hasSeparateWeights(const ReflectanceField& field, const ShadeOptions& options) {
  return field.rig.lights.empty() || (field.isFullProduct && !weighsPairs(field, options));
}

std::vector<Direction3<AcquisitionSpace, double>> lightDirections(const ReflectanceField& field) {
  std::vector<Direction3<AcquisitionSpace, double>> directions;
  for (const capture::Light& light : field.rig.lights)
    directions.push_back(capture::towardsLight(light, field.middle));
  return directions;
}

double lightSpacing(const ReflectanceField& field) {
  return ulr::LightExtrapolationFade(lightDirections(field)).spacing();
}

std::optional<ulr::LightTable> lightTable(const ReflectanceField& field, const ShadeOptions& options,
                                          ulr::LightExtrapolation extrapolation) {
  const auto isDirectional = [](const capture::Light& light) {
    return std::holds_alternative<capture::DirectionalLight>(light.kind);
  };
  if (!field.isFullProduct || !std::ranges::all_of(field.rig.lights, isDirectional)) return std::nullopt;
  return ulr::LightTable(lightDirections(field), lightBlend(field, options),
                         options.nearest ? ulr::LightExtrapolation::clamp : extrapolation);
}

SharedColor sharedColor(std::span<const capture::Light> lights) {
  if (lights.empty()) return {};
  constexpr double kRounding = 0x1p-22;
  const std::array<double, 3> first = strengthOf(lights[0]);
  const auto strongest = static_cast<size_t>(std::ranges::max_element(first) - first.begin());
  for (const capture::Light& light : lights) {
    const std::array<double, 3> strength = strengthOf(light);
    for (size_t c = 0; c < 3; ++c) {
      const double expected = first[c] * strength[strongest];
      if (!(std::abs(strength[c] * first[strongest] - expected) <= kRounding * expected)) return {};
    }
  }
  const auto inverse = [&](size_t c) { return static_cast<float>(first[strongest] / first[c]); };
  return {Rgb{inverse(0), inverse(1), inverse(2)}, static_cast<Eigen::Index>(strongest)};
}

CapturedLights::CapturedLights(std::span<const capture::Light> lights)
    : lights_(lights), color_(sharedColor(lights)), towards_(lights.size()), inverse_(lights.size()),
      evaluatedAt_(lights.size(), 0) {
  if (!std::ranges::all_of(lights, isUniform)) return;
  evaluateAll();
  areUniform_ = true;
}

void CapturedLights::compute(uint32_t light) {
  towards_[light] = capture::towardsLight(lights_[light], place_).cast<float>();
  const Rgb captured = capture::irradianceAt(lights_[light], place_);
  const auto inverse = [](float x) { return x >= std::numeric_limits<float>::min() ? 1 / x : 0; };
  inverse_[light] = {1, inverse(captured.r), inverse(captured.g), inverse(captured.b)};
  evaluatedAt_[light] = current_;
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

LightWeights::LightWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
                           const QueryBatch& batch, const ShadeOptions& options, LightSources sources)
    : field_(field), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      lightCount_(sources == LightSources::all ? batch.lights : 0), lightBlend_(lightBlend(field, options)),
      hasShortRows_(batch.environments.empty() &&
                    2 * lightCount_ * lightBlend_.lights <= field.rig.lights.size()),
      showsColors_(options.showsBlends), lights_(field.rig.lights),
      ulr_(ulr::sourcesOf(ulr::viewpointsOf(field.rig.lights)), lightBlend_.weightError),
      environmentUlr_(ulr_), ulrOfLight_(lightCount_),
      canBeGrouped_(hasShortRows_ && lights_.areUniform() && lights_.inverseColor() && !showsColors_),
      sums_(field.rig.lights.size()), lightColor_(blendColors(field.rig.lights.size())),
      environmentBrightness_(environmentBrightness(batch)), share_(field.rig.lights.size()),
      cosine_(field.rig.lights.size()) {
  for (size_t l = 0; l < lightCount_; ++l) canBeGrouped_ &= isPlainUlr(batch.extrapolationOf(l));
  for (const QueryEnvironment& environment : batch.environments)
    environments_.emplace_back(environment.table ? environment.lights
                                                 : std::span<const ulr::EnvironmentLight>());
}

void LightWeights::prepare(size_t begin, size_t count, LightRows& rows) {
  begin_ = begin;
  count_ = count;
  std::array<Point3<AcquisitionSpace>, ulr::kQueryLanes> places;
  for (size_t lane = 0; lane < count; ++lane) places[lane] = field_.cloud.p0[batch_.surfels[begin + lane]];
  ulr_.setPlaces({places.data(), count});
  std::array<Direction3<AcquisitionSpace>, ulr::kQueryLanes> towards;
  for (size_t l = 0; l < lightCount_; ++l) {
    for (size_t lane = 0; lane < count; ++lane)
      towards[lane] = batch_.towardsLight[(begin + lane) * batch_.lights + l];
    ulr_.blend({towards.data(), count}, lightBlend_.lights, ulrOfLight_[l]);
  }
  isGrouped_ = canBeGrouped_ && std::ranges::all_of(ulrOfLight_, &ulr::QueryBlends::areAllPrecise);
  if (isGrouped_) appendGroup(rows);
}

LightWeights::Row LightWeights::append(size_t lane, LightRows& rows) {
  color_ = {};
  if (isGrouped_) return {rowEnds_[lane], rowEnds_[lane + 1]};
  const size_t begin = rows.lights.size();
  lights_.moveTo(field_.cloud.p0[batch_.surfels[begin_ + lane]].cast<double>());
  if (hasShortRows_) {
    forEachLight(lane,
                 [&](const Rgb& now, const auto& forEachWeight) { appendLight(now, forEachWeight, rows); });
    return {begin, rows.lights.size()};
  }
  forEachLight(lane, [&](const Rgb& now, const auto& forEachWeight) {
    const Eigen::Array4f irradiance = fourFloats(0, now.r, now.g, now.b);
    forEachWeight(
        [&](uint32_t light, float weight) { sums_.add(light, weight * lights_.ratio(irradiance, light)); });
  });
  for (size_t e = 0; e < batch_.environments.size(); ++e) addEnvironment(begin_ + lane, e);
  sums_.moveTo(rows);
  return {begin, rows.lights.size()};
}

// Appends the rows of a whole group, as appendLight would.
void LightWeights::appendGroup(LightRows& rows) {
  size_t next = rows.weights.size();
  rows.weights.resize(next + count_ * lightCount_ * lightBlend_.lights);
  rowEnds_[0] = rows.lights.size();
  for (size_t lane = 0; lane < count_; ++lane) {
    size_t entry = (begin_ + lane) * batch_.lights;
    for (const ulr::QueryBlends& ulr : ulrOfLight_) {
      assert(ulr.size() == lightBlend_.lights);
      const Rgb& now = batch_.irradiance[entry++];
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
template <class ForEach>
void LightWeights::appendLight(const Rgb& now, const ForEach& forEachWeight, LightRows& rows) const {
  if (lights_.inverseColor()) {
    const auto begin = static_cast<uint32_t>(rows.weights.size());
    forEachWeight([&](uint32_t light, float weight) {
      rows.weights.push_back({light, weight * lights_.inverseStrength(light)});
    });
    rows.lights.push_back({*lights_.inverseColor() * now, begin, static_cast<uint32_t>(rows.weights.size())});
    return;
  }
  forEachWeight([&](uint32_t light, float weight) {
    const Eigen::Array4f ratio = weight * lights_.ratio(fourFloats(0, now.r, now.g, now.b), light);
    rows.add(light, {ratio[1], ratio[2], ratio[3]});
  });
}

// Calls use(f_q E_q, forEachWeight) for each light q that is not dark; forEachWeight calls use(l, c_q u_ql)
// for each captured light l that is blended.
template <class Use> void LightWeights::forEachLight(size_t lane, const Use& use) {
  const size_t query = begin_ + lane;
  if (lightBlend_.foreshortened) setNormal(batch_.surfels[query]);
  const float share = 1 / static_cast<float>(batch_.sources());
  const auto useBlend = [&](const Rgb& now, const auto& forEachWeight) {
    if (now != Rgb{}) use(now, forEachWeight);
    if (showsColors_)
      forEachWeight([&](uint32_t light, float weight) { addToBlendColor(light, weight * share); });
  };
  for (size_t l = 0; l < lightCount_; ++l) {
    const size_t entry = query * batch_.lights + l;
    const Rgb& irradiance = batch_.irradiance[entry];
    const ulr::QueryBlends& ulr = ulrOfLight_[l];
    if (isPlainUlr(batch_.extrapolationOf(l)) && ulr.isPrecise(lane)) {
      useBlend(irradiance, [&](const auto& each) {
        ulr.forEach(lane, [&](uint32_t light, float weight) {
          lights_.evaluate(light);
          each(light, weight);
        });
      });
      continue;
    }
    const auto& towards = batch_.towardsLight[entry];
    const ulr::BlendSet blend = blendOf(ulr, lane, towards, batch_.extrapolationOf(l));
    useBlend(foreshorteningOf(blend, towards) * irradiance, [&](const auto& each) {
      for (const auto& [light, weight] : blend) each(light, weight);
    });
  }
}

// c_q u_ql of one light; evaluates the blended lights.
ulr::BlendSet LightWeights::blendOf(const ulr::QueryBlends& ulr, size_t lane,
                                    const Direction3<AcquisitionSpace>& towards,
                                    ulr::LightExtrapolation extrapolation) {
  const ulr::LightExtrapolation beyond = nearest_ ? ulr::LightExtrapolation::clamp : extrapolation;
  if (!ulr.isPrecise(lane)) { // single precision lost a direction
    lights_.evaluateAll();
    return ulr::blendOfLights(lights_.towards(), towards, lightBlend_, coverage_, beyond);
  }
  const ulr::BlendSet mean = ulr.of(lane);
  for (const auto& [light, weight] : mean) lights_.evaluate(light);
  return ulr::fittedBlend(mean, ulr.penalty(lane), lights_.towards(), towards, lightBlend_, coverage_,
                          beyond);
}

void LightWeights::setNormal(uint32_t surfel) {
  lights_.evaluateAll();
  normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(field_.cloud.r0[surfel]).col(2));
  for (size_t light = 0; light < cosine_.size(); ++light)
    cosine_[light] = ulr::foreshortenedCosine(normal_, lights_.towards(light));
}

// Foreshortening f_q.
float LightWeights::foreshorteningOf(const ulr::BlendSet& blend,
                                     const Direction3<AcquisitionSpace>& towards) const {
  if (!lightBlend_.foreshortened) return 1;
  return ulr::foreshortening(ulr::foreshortenedCosine(normal_, towards), ulr::blendedCosine(blend, cosine_));
}

// Adds an environment, the sum of its lights: its irradiance is distributed to the captured lights around the
// surfel, then divided by theirs.
void LightWeights::addEnvironment(size_t query, size_t e) {
  const QueryEnvironment& environment = batch_.environments[e];
  if (environment.lights.empty()) return;
  std::ranges::fill(share_, Eigen::Array4f::Zero());
  lights_.evaluateAll();
  shareEnvironment(e, batch_.rotationOf(query, e));
  const Rgb& strength = environment.strength;
  const Eigen::Array4f scale(1 / (environmentBrightness_[e] * static_cast<float>(batch_.sources())),
                             strength.r, strength.g, strength.b);
  for (uint32_t light = 0; light < share_.size(); ++light)
    if (share_[light][3] != 0) { // 0 for all lights if the environment is dark
      const Eigen::Array4f now(share_[light][3], share_[light][0], share_[light][1], share_[light][2]);
      const Eigen::Array4f weight = lights_.ratio(scale * now, light);
      sums_.add(light, weight);
      addToBlendColor(light, weight[0]);
    }
}

void LightWeights::shareEnvironment(size_t e,
                                    const Rotation<AcquisitionSpace, EnvironmentSpace, float>& rotation) {
  const QueryEnvironment& environment = batch_.environments[e];
  const ulr::Foreshortened surface{normal_, cosine_};
  if (environment.table) {
    environment.table->spread(environments_[e], rotation, share_,
                              lightBlend_.foreshortened ? &surface : nullptr);
    return;
  }
  const Point3<AcquisitionSpace> place = lights_.place().cast<float>();
  environmentUlr_.setPlaces({&place, 1});
  std::array<Direction3<AcquisitionSpace>, ulr::kQueryLanes> towards;
  for (size_t begin = 0; begin < environment.lights.size(); begin += ulr::kQueryLanes) {
    const auto lights =
        environment.lights.subspan(begin, std::min(ulr::kQueryLanes, environment.lights.size() - begin));
    for (size_t i = 0; i < lights.size(); ++i) towards[i] = rotation(lights[i].towards);
    environmentUlr_.blend({towards.data(), lights.size()}, lightBlend_.lights, ulrOfEnvironment_);
    for (size_t i = 0; i < lights.size(); ++i) {
      const ulr::BlendSet blend = blendOf(ulrOfEnvironment_, i, towards[i], environment.extrapolation);
      const Rgb& irradiance = lights[i].irradiance;
      const Rgb scaled = foreshorteningOf(blend, towards[i]) * irradiance;
      for (const auto& [light, weight] : blend)
        share_[light] += weight * Eigen::Array4f(scaled.r, scaled.g, scaled.b, brightness(irradiance));
    }
  }
}

} // namespace surflect::shading
