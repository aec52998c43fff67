#include "srf/model/rig_lights.h"

#include <array>
#include <cmath>

namespace surflect::model {

std::vector<ulr::Source> sourcesOf(std::span<const capture::Light> lights) {
  std::vector<ulr::Source> sources;
  for (const capture::Light& light : lights) {
    const auto* point = std::get_if<capture::PointLight>(&light.kind);
    sources.push_back({point ? point->position.raw() : capture::towardsLight(light, {}).raw(), !point});
  }
  return sources;
}

namespace {

std::array<double, 3> strengthOf(const capture::Light& light) {
  const auto* directional = std::get_if<capture::DirectionalLight>(&light.kind);
  const Rgb strength =
      directional ? directional->irradiance : std::get<capture::PointLight>(light.kind).intensity;
  return {strength.r, strength.g, strength.b};
}

} // namespace

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

} // namespace surflect::model
