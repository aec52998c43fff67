#include "render/surfels/surfel_knobs.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

namespace surflect::surfels {

namespace {

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

// Throws Error unless the value is 0 or 1.
bool isOn(double value) {
  if (value != 0 && value != 1) throw Error::mismatch("0 or 1", numberText(value));
  return value != 0;
}

} // namespace

std::vector<knobs::Knob> knobsOf(const shading::ReflectanceField& field, const FrameOptions& full) {
  std::vector<knobs::Knob> knobs;
  if (full.shade.nearest) {
    // blends nothing
  } else if (field.hasSeparateWeights()) {
    knobs.push_back({"cameras", "cameras blended per surfel", downToOne(full.shade.cameras)});
    if (!field.rig.lights.empty())
      knobs.push_back({"lights", "captured lights blended per light of the script",
                       downToOne(shading::lightBlend(field, full.shade).lights)});
  } else {
    knobs.push_back({"pairs", "camera-light pairs blended per surfel and light of the script",
                     downToOne(full.shade.pairs)});
  }
  knobs.push_back(
      {"layer_search",
       "1: searches for all splats of a pixel's nearest surface; 0: only until they fill the pixel",
       {1, 0}});
  return knobs;
}

FrameOptions turned(const FrameOptions& full, const std::vector<knobs::Knob>& knobs,
                    const knobs::Setting& setting) {
  knobs::requireKnobs(knobs, setting);
  FrameOptions options = full;
  for (const knobs::Knob& knob : knobs) {
    const auto found = setting.find(knob.name);
    if (found == setting.end()) continue;
    const double value = found->second;
    try {
      if (knob.name == "cameras") options.shade.cameras = countOf(value, knob.values.front());
      if (knob.name == "lights") options.shade.lights = countOf(value, knob.values.front());
      if (knob.name == "layer_search") options.splats.searchLayers = isOn(value);
      if (knob.name == "pairs") options.shade.pairs = countOf(value, knob.values.front());
    } catch (Error& error) {
      throw std::move(error).at(knob.name).at("knob");
    }
  }
  return options;
}

} // namespace surflect::surfels
