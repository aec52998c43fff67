#include "srf/model/light_folder.h"

#include "srf/model/planning.h"
#include "srf/ulr/foreshortening.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>

namespace surflect::model {

namespace {

// Made in a register. Written to memory one by one, as Eigen's constructor does, they cannot be read from it
// together until all have arrived there, a dozen cycles later.
Eigen::Array4f fourFloats(float a, float b, float c, float d) {
  typedef float Four __attribute__((vector_size(16)));
  const Four four{a, b, c, d};
  Eigen::Array4f all;
  std::memcpy(all.data(), &four, sizeof four);
  return all;
}

} // namespace

LightFolder::LightFolder(const Model& model, const ulr::LightCoverage& coverage, const QueryBatch& batch,
                         const ShadeOptions& options)
    : model_(model), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      how_(lightBlend(model, options)), lights_(model.rig.lights),
      rig_(sourcesOf(model.rig.lights), options.simd), near_(rig_), chosen_(batch.lights),
      row_(model.rig.lights.size()),
      isShort_(batch.environments.empty() && 2 * batch.lights * how_.lights <= model.rig.lights.size()),
      showsColors_(options.showsBlends), lightColor_(indexColors(model.rig.lights.size())),
      environmentBrightness_(environmentBrightness(batch)), share_(model.rig.lights.size()),
      cosine_(model.rig.lights.size()) {
  mayBeTogether_ = isShort_ && lights_.areUniform() && lights_.inverseColor() && !showsColors_;
  for (size_t l = 0; l < batch.lights; ++l) mayBeTogether_ &= isPlain(batch.uncoveredOf(l));
  for (const QueryEnvironment& environment : batch.environments)
    environments_.emplace_back(
        environment.table ? environment.lights : std::span<const ulr::EnvironmentLight>(), options.simd);
}

void LightFolder::choose(size_t begin, size_t count, codec::LightRows& rows) {
  begin_ = begin;
  count_ = count;
  std::array<Point3<AcquisitionSpace>, ulr::kChoiceLanes> places;
  for (size_t lane = 0; lane < count; ++lane) places[lane] = model_.cloud.p0[batch_.surfels[begin + lane]];
  rig_.lookFrom({places.data(), count});
  std::array<Direction3<AcquisitionSpace>, ulr::kChoiceLanes> towards;
  for (size_t l = 0; l < batch_.lights; ++l) {
    for (size_t lane = 0; lane < count; ++lane)
      towards[lane] = batch_.towardsLight[(begin + lane) * batch_.lights + l];
    rig_.blend({towards.data(), count}, how_.lights, chosen_[l]);
  }
  areTogether_ = mayBeTogether_ && std::ranges::all_of(chosen_, &ulr::LaneBlends::areWhole);
  if (areTogether_) foldTogether(rows);
}

LightFolder::Row LightFolder::fold(size_t lane, codec::LightRows& rows) {
  color_ = {};
  if (areTogether_) return {ends_[lane], ends_[lane + 1]};
  const size_t begin = rows.lights.size();
  foldOne(lane, rows);
  return {begin, rows.lights.size()};
}

// As addBlend has them.
void LightFolder::foldTogether(codec::LightRows& rows) {
  size_t next = rows.weights.size();
  rows.weights.resize(next + count_ * batch_.lights * how_.lights);
  size_t entry = begin_ * batch_.lights;
  ends_[0] = rows.lights.size();
  for (size_t lane = 0; lane < count_; ++lane) {
    for (const ulr::LaneBlends& blends : chosen_) {
      assert(blends.size() == how_.lights);
      const Rgb& now = batch_.irradiance[entry++];
      if (now == Rgb{}) continue;
      const auto begin = static_cast<uint32_t>(next);
      for (size_t i = 0; i < blends.size(); ++i) {
        const uint32_t light = blends.index(lane, i);
        rows.weights[next++] = {light, blends.weight(lane, i) * lights_.inverseStrength(light)};
      }
      rows.lights.push_back({*lights_.inverseColor() * now, begin, static_cast<uint32_t>(next)});
    }
    ends_[lane + 1] = rows.lights.size();
  }
  rows.weights.resize(next);
}

void LightFolder::foldOne(size_t lane, codec::LightRows& rows) {
  lights_.lookFrom(model_.cloud.p0[batch_.surfels[begin_ + lane]].cast<double>());
  if (isShort_) {
    foldLights(lane,
               [&](const Rgb& now, const auto& forEachOfBlend) { addBlend(now, forEachOfBlend, rows); });
    return;
  }
  foldLights(lane, [&](const Rgb& now, const auto& forEachOfBlend) {
    const Eigen::Array4f shining = fourFloats(0, now.r, now.g, now.b);
    forEachOfBlend(
        [&](uint32_t light, float weight) { row_.add(light, weight * lights_.ratio(shining, light)); });
  });
  for (size_t e = 0; e < batch_.environments.size(); ++e) foldEnvironment(begin_ + lane, e);
  row_.take(rows);
}

// Appends a light, or as many as it blends if these have colours of their own.
template <class ForEach>
void LightFolder::addBlend(const Rgb& now, const ForEach& forEachOfBlend, codec::LightRows& rows) const {
  if (lights_.inverseColor()) {
    const auto begin = static_cast<uint32_t>(rows.weights.size());
    forEachOfBlend([&](uint32_t light, float weight) {
      rows.weights.push_back({light, weight * lights_.inverseStrength(light)});
    });
    rows.lights.push_back({*lights_.inverseColor() * now, begin, static_cast<uint32_t>(rows.weights.size())});
    return;
  }
  forEachOfBlend([&](uint32_t light, float weight) {
    const Eigen::Array4f ratio = weight * lights_.ratio(fourFloats(0, now.r, now.g, now.b), light);
    rows.add(light, {ratio[1], ratio[2], ratio[3]});
  });
}

// use(now, forEachOfBlend) for each light that shines: what falls on the surface, and what calls
// use(light, weight) for each captured light that is blended.
template <class Use> void LightFolder::foldLights(size_t lane, const Use& use) {
  const size_t query = begin_ + lane;
  if (how_.foreshortened) faceLights(batch_.surfels[query]);
  const float share = 1 / static_cast<float>(batch_.targets());
  const auto useBlend = [&](const Rgb& now, const auto& forEachOfBlend) {
    if (now != Rgb{}) use(now, forEachOfBlend);
    if (showsColors_) forEachOfBlend([&](uint32_t light, float weight) { show(light, weight * share); });
  };
  for (size_t l = 0; l < batch_.lights; ++l) {
    const size_t entry = query * batch_.lights + l;
    const Rgb& irradiance = batch_.irradiance[entry];
    if (isPlain(batch_.uncoveredOf(l)) && chosen_[l].isSure(lane)) {
      useBlend(irradiance, [&](const auto& each) {
        chosen_[l].forEach(lane, [&](uint32_t light, float weight) {
          lights_.face(light);
          each(light, weight);
        });
      });
      continue;
    }
    const auto& towards = batch_.towardsLight[entry];
    const ulr::BlendSet blend = finish(chosen_[l], lane, towards, batch_.uncoveredOf(l));
    useBlend(foreshorteningOf(blend, towards) * irradiance, [&](const auto& each) {
      for (const auto& [light, weight] : blend) each(light, weight);
    });
  }
}

// From the lane's ULR weights, with the blended lights faced.
ulr::BlendSet LightFolder::finish(const ulr::LaneBlends& blends, size_t lane,
                                  const Direction3<AcquisitionSpace>& towards,
                                  ulr::LightExtrapolation extrapolation) {
  const ulr::LightExtrapolation beyond = nearest_ ? ulr::LightExtrapolation::clamp : extrapolation;
  if (!blends.isSure(lane)) {
    lights_.faceAll();
    return ulr::blendOfLights(lights_.towards(), towards, how_, coverage_, beyond);
  }
  const ulr::BlendSet ulr = blends.of(lane);
  for (const auto& [light, weight] : ulr) lights_.face(light);
  return ulr::fitted(ulr, blends.penalty(lane), lights_.towards(), towards, how_, coverage_, beyond);
}

void LightFolder::faceLights(uint32_t surfel) {
  lights_.faceAll();
  normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(model_.cloud.r0[surfel]).col(2));
  for (size_t light = 0; light < cosine_.size(); ++light)
    cosine_[light] = ulr::foreshortenedCosine(normal_, lights_.towards(light));
}

// What the radiance under the blended lights is multiplied by.
float LightFolder::foreshorteningOf(const ulr::BlendSet& blend,
                                    const Direction3<AcquisitionSpace>& towards) const {
  if (!how_.foreshortened) return 1;
  return ulr::foreshortening(ulr::foreshortenedCosine(normal_, towards), ulr::blendedCosine(blend, cosine_));
}

// By the linearity of light: what falls from around each captured light, as a share of the row.
void LightFolder::foldEnvironment(size_t query, size_t e) {
  const QueryEnvironment& environment = batch_.environments[e];
  if (environment.lights.empty()) return;
  std::ranges::fill(share_, Eigen::Array4f::Zero());
  lights_.faceAll();
  shareEnvironment(e, batch_.turnOf(query, e));
  const Rgb& strength = environment.strength;
  const Eigen::Array4f scale(1 / (environmentBrightness_[e] * static_cast<float>(batch_.targets())),
                             strength.r, strength.g, strength.b);
  for (uint32_t light = 0; light < share_.size(); ++light)
    if (share_[light][3] != 0) { // 0 also where the environment is dark, and nothing a share of it
      const Eigen::Array4f now(share_[light][3], share_[light][0], share_[light][1], share_[light][2]);
      const Eigen::Array4f weight = lights_.ratio(scale * now, light);
      row_.add(light, weight);
      show(light, weight[0]);
    }
}

void LightFolder::shareEnvironment(
    size_t e, const Rotation<AcquisitionSpace, EnvironmentSpace, float>& acquisitionFromEnvironment) {
  const QueryEnvironment& environment = batch_.environments[e];
  const ulr::Foreshortened surface{normal_, cosine_};
  if (environment.table) {
    environment.table->spread(environments_[e], acquisitionFromEnvironment, share_,
                              how_.foreshortened ? &surface : nullptr);
    return;
  }
  const Point3<AcquisitionSpace> place = lights_.place().cast<float>();
  near_.lookFrom({&place, 1});
  std::array<Direction3<AcquisitionSpace>, ulr::kChoiceLanes> towards;
  for (size_t begin = 0; begin < environment.lights.size(); begin += ulr::kChoiceLanes) {
    const auto lights =
        environment.lights.subspan(begin, std::min(ulr::kChoiceLanes, environment.lights.size() - begin));
    for (size_t i = 0; i < lights.size(); ++i) towards[i] = acquisitionFromEnvironment(lights[i].towards);
    near_.blend({towards.data(), lights.size()}, how_.lights, blends_);
    for (size_t i = 0; i < lights.size(); ++i) {
      const ulr::BlendSet blend = finish(blends_, i, towards[i], environment.extrapolation);
      const Rgb& irradiance = lights[i].irradiance;
      const Rgb scaled = foreshorteningOf(blend, towards[i]) * irradiance;
      for (const auto& [light, weight] : blend)
        share_[light] += weight * Eigen::Array4f(scaled.r, scaled.g, scaled.b, brightness(irradiance));
    }
  }
}

} // namespace surflect::model
