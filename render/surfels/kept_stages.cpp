#include "render/surfels/kept_stages.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace surflect::surfels {

namespace {

// Bindings name every member: a member that is added does not compile until it is compared here.

bool isSameCamera(const capture::Camera<ObjectSpace>& left, const capture::Camera<ObjectSpace>& right) {
  const auto& [lens, pose] = left;
  const auto& [otherLens, otherPose] = right;
  return lens == otherLens && pose.rotation() == otherPose.rotation() &&
         pose.translation() == otherPose.translation();
}

bool isSame(const scene::ShotPointLight& left, const scene::ShotPointLight& right) {
  const auto& [position, intensity, extrapolation] = left;
  const auto& [otherPosition, otherIntensity, otherExtrapolation] = right;
  return position == otherPosition && intensity == otherIntensity && extrapolation == otherExtrapolation;
}

bool isSame(const scene::ShotDirectionalLight& left, const scene::ShotDirectionalLight& right) {
  const auto& [towards, irradiance, extrapolation, gradient] = left;
  const auto& [otherTowards, otherIrradiance, otherExtrapolation, otherGradient] = right;
  return towards == otherTowards && irradiance == otherIrradiance && extrapolation == otherExtrapolation &&
         gradient == otherGradient;
}

} // namespace

bool operator==(const RasterKey& left, const RasterKey& right) {
  const auto& [camera, splats, isCut] = left;
  const auto& [otherCamera, otherSplats, otherIsCut] = right;
  return isSameCamera(camera, otherCamera) && splats == otherSplats && isCut == otherIsCut;
}

bool isSameLight(const scene::ShotLight& a, const scene::ShotLight& b) {
  if (a.index() != b.index()) return false;
  if (const auto* point = std::get_if<scene::ShotPointLight>(&a))
    return isSame(*point, std::get<scene::ShotPointLight>(b));
  const auto* directional = std::get_if<scene::ShotDirectionalLight>(&a);
  return directional && isSame(*directional, std::get<scene::ShotDirectionalLight>(b));
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
  for (const size_t unmatched : shaded.unmatchedAt)
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
