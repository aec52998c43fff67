#include "srf/weights/irradiance_ratio.h"

#include <array>
#include <cmath>
#include <limits>
#include <variant>

namespace surflect::weights {

namespace {

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

} // namespace surflect::weights
