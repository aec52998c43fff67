#include "render/surfels/surfel_knobs.h"

#include "srf/ulr/weight_truncation.h"
#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace surflect::surfels {

namespace {

constexpr double kLargestPatch = 4096, kLargestSize = 64;

// n, n - 1, .. 1
std::vector<double> downToOne(size_t n) {
  std::vector<double> values;
  for (size_t value = n; value >= 1; --value) values.push_back(static_cast<double>(value));
  return values;
}

// Throws Error unless the value is a whole number of 1 to `most`.
size_t countOf(double value, double most) {
  if (!(value >= 1 && value <= most) || value != std::floor(value))
    throw Error::mismatch(fmt::format("a whole number of 1 to {}", most), numberText(value));
  return static_cast<size_t>(value);
}

// Throws Error unless the value is 0 to `most`.
float numberOf(double value, double most) {
  if (!(value >= 0 && value <= most))
    throw Error::mismatch(fmt::format("a number of 0 to {}", most), numberText(value));
  return static_cast<float>(value);
}

// Throws Error unless the value is 0 or 1.
bool isOn(double value) {
  if (value != 0 && value != 1) throw Error::mismatch("0 or 1", numberText(value));
  return value != 0;
}

} // namespace

std::vector<SurfelKnob> knobsOf(const shading::ReflectanceField& field, const FrameOptions& full) {
  std::vector<SurfelKnob> knobs;
  if (full.shade.nearest) return knobs;
  const auto add = [&](const char* name, const char* meaning, std::vector<double> values,
                       std::optional<double> preview, auto apply) {
    knobs.push_back({{name, meaning, std::move(values)}, preview, apply});
  };
  const bool isLit = !field.rig.lights.empty(), isProduct = field.isFullProduct || !isLit;
  if (shading::weighsPairs(field, full.shade) &&
      shading::interpolationOf(field, full.shade) == shading::Interpolation::kriging)
    add("interpolation",
        "weights of photographs. 2: kriging of camera-light pairs; 1: pairs by ULR; 0: cameras and lights "
        "apart",
        {2, 1, 0}, {}, [](double value, FrameOptions& options) {
          constexpr std::array kinds{shading::Interpolation::separate, shading::Interpolation::pairs,
                                     shading::Interpolation::kriging};
          options.shade.interpolation = value == 0 ? kinds[0] : kinds[countOf(value, 2)];
        });
  if (isProduct)
    add("cameras", "cameras blended per surfel", downToOne(full.shade.cameras), {},
        [most = static_cast<double>(full.shade.cameras)](double value, FrameOptions& options) {
          options.shade.cameras = countOf(value, most);
        });
  if (isProduct && isLit) {
    const size_t lights = shading::lightBlend(field, full.shade).lights;
    add("lights", "captured lights blended per light of the script", downToOne(lights), {},
        [most = static_cast<double>(lights)](double value, FrameOptions& options) {
          options.shade.lights = countOf(value, most);
        });
  }
  if (!shading::hasSeparateWeights(field, full.shade)) {
    const size_t pairs = shading::pairCount(field, full.shade);
    add("pairs", "camera-light pairs blended per surfel and light of the script", downToOne(pairs), {},
        [most = static_cast<double>(pairs)](double value, FrameOptions& options) {
          options.shade.pairs = countOf(value, most);
        });
  }
  add("weight_error", "weight that may be left out of a blend of cameras or lights",
      {0, 0.02, 0.05, 0.1, 0.2, 0.4}, 0.05, [](double value, FrameOptions& options) {
        options.shade.weightError = numberOf(value, ulr::kMostTruncated);
      });
  if (isLit)
    add("environment_error",
        "error of captured lights' weights, within which few lights stand for an environment",
        {0, 0.02, 0.05, 0.1, 0.2}, 0.05,
        [](double value, FrameOptions& options) { options.environmentError = numberOf(value, 1); });
  add("layer_search",
      "1: searches for all splats of a pixel's nearest surface; 0: only until they fill the pixel", {1, 0}, 0,
      [](double value, FrameOptions& options) { options.splats.searchLayers = isOn(value); });
  add("surfel_size", "pixels between neighbouring surfels at least; 0: all surfels",
      {0, 0.5, 0.7, 1, 1.4, 2, 2.8}, 0.7,
      [](double value, FrameOptions& options) { options.surfelSize = numberOf(value, kLargestSize); });
  add("patch", "surfels that share the weights of cameras and lights", {1, 2, 4, 8, 16}, 4,
      [](double value, FrameOptions& options) { options.surfelsPerPatch = countOf(value, kLargestPatch); });
  return knobs;
}

knobs::Setting previewOf(const std::vector<SurfelKnob>& knobs) {
  knobs::Setting setting;
  for (const SurfelKnob& each : knobs)
    if (each.preview) setting[each.knob.name] = *each.preview;
  return setting;
}

FrameOptions turned(const FrameOptions& full, const std::vector<SurfelKnob>& knobs,
                    const knobs::Setting& setting) {
  FrameOptions options = full;
  for (const SurfelKnob& each : knobs) {
    const auto found = setting.find(each.knob.name);
    if (found == setting.end()) continue;
    try {
      each.apply(found->second, options);
    } catch (Error& error) {
      throw std::move(error).at(each.knob.name).at("knob");
    }
  }
  return options;
}

} // namespace surflect::surfels
