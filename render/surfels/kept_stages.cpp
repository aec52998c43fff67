#include "render/surfels/kept_stages.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace surflect::surfels {

bool operator==(const RasterKey& a, const RasterKey& b) {
  const auto &poseA = a.camera.cameraFromWorld, &poseB = b.camera.cameraFromWorld;
  return a.camera.lens == b.camera.lens && poseA.rotation() == poseB.rotation() &&
         poseA.translation() == poseB.translation() && a.splats == b.splats && a.isCut == b.isCut;
}

bool isSameLight(const scene::ShotLight& a, const scene::ShotLight& b) {
  if (a.index() != b.index()) return false;
  if (const auto* point = std::get_if<scene::ShotPointLight>(&a)) {
    const auto& other = std::get<scene::ShotPointLight>(b);
    return point->position == other.position && point->intensity == other.intensity &&
           point->extrapolation == other.extrapolation;
  }
  const auto* directional = std::get_if<scene::ShotDirectionalLight>(&a);
  if (!directional) return false;
  const auto& other = std::get<scene::ShotDirectionalLight>(b);
  return directional->towards == other.towards && directional->irradiance == other.irradiance &&
         directional->extrapolation == other.extrapolation &&
         directional->irradianceGradient == other.irradianceGradient;
}

KeptAnswers::Missing KeptAnswers::missing(const QueryKey& key, std::span<const scene::ShotLight> lights,
                                          const PatchCorners& corners) const {
  assert(!lights.empty());
  Missing missing;
  for (uint32_t l = 0; l < lights.size(); ++l)
    (key_ == key && isSameLight(lights_[l], lights[l]) ? missing.others : missing.lights).push_back(l);
  if (missing.lights.empty()) {
    missing.lights.push_back(missing.others.back());
    missing.others.pop_back();
  }
  if (!missing.others.empty()) missing.groups = changedGroups(corners_, corners);
  return missing;
}

void KeptAnswers::begin(size_t lights, size_t places, size_t targetsPerLight) {
  key_.reset();
  lightCount_ = lights;
  perPlace_ = lights * targetsPerLight;
  targets_.resize(places * perPlace_);
  isUnmatched_.resize(places * lights);
}

void KeptAnswers::take(const shading::Shaded& shaded, std::span<const uint32_t> lights,
                       std::span<const uint32_t> places) {
  const size_t count = lightCount_, perPlace = perPlace_ / count * lights.size();
  assert(shaded.targets.size() == places.size() * perPlace);
  for (size_t i = 0; i < places.size(); ++i)
    for (size_t t = 0; t < perPlace; ++t)
      targets_[places[i] * perPlace_ + t / lights.size() * count + lights[t % lights.size()]] =
          shaded.targets[i * perPlace + t];
  for (const uint32_t place : places)
    for (const uint32_t light : lights) isUnmatched_[place * count + light] = 0;
  for (const uint32_t unmatched : shaded.unmatchedShadows)
    isUnmatched_[places[unmatched / lights.size()] * count + lights[unmatched % lights.size()]] = 1;
}

void KeptAnswers::finish(const QueryKey& key, std::span<const scene::ShotLight> lights,
                         PatchCorners corners) {
  key_ = key;
  lights_.assign(lights.begin(), lights.end());
  corners_ = std::move(corners);
}

std::vector<Rgb> KeptAnswers::radiance() const { return shading::summed(targets_, perPlace_); }

size_t KeptAnswers::unmatchedShadows() const {
  return static_cast<size_t>(std::ranges::count(isUnmatched_, uint8_t{1}));
}

} // namespace surflect::surfels
