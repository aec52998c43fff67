#include "srf/model/planning.h"

#include <algorithm>
#include <cmath>

namespace surflect::model {

namespace {

// Steps of sqrt(2) turns of hue: those of the golden section would give one colour to neighbours on a
// Fibonacci spiral, as which rigs are often laid out.
Rgb colorOf(uint32_t index) {
  const double turns = index * 0.41421356237309515;
  const double hue = 6 * (turns - std::floor(turns));
  const auto channel = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  return {channel(std::abs(hue - 3) - 1), channel(2 - std::abs(hue - 2)), channel(2 - std::abs(hue - 4))};
}

} // namespace

ViewProjectors projectorsOf(std::span<const capture::View> views) {
  ViewProjectors all;
  for (const capture::View& view : views) all.emplace_back(view.camera);
  return all;
}

std::vector<Rgb> indexColors(size_t count) {
  std::vector<Rgb> all;
  for (uint32_t i = 0; i < count; ++i) all.push_back(colorOf(i));
  return all;
}

std::vector<float> environmentBrightness(const QueryBatch& batch) {
  std::vector<float> all;
  for (const QueryEnvironment& environment : batch.environments)
    all.push_back(brightness(ulr::totalIrradiance(environment.lights)));
  return all;
}

} // namespace surflect::model
