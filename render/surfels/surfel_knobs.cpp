#include "render/surfels/surfel_knobs.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

namespace surflect::surfels {

namespace {

constexpr double kLargestPatch = 4096, kLargestSize = 64;

// n, n - 1, .. 1
std::vector<double> downToOne(size_t n) {
  std::vector<double> values;
  for (size_t value = n; value >= 1; --value) values.push_back(static_cast<double>(value));
  return values;
}

// Throws Error unless the value is a number of pixels.
double sizeOf(double value) {
  if (!(value >= 0 && value <= kLargestSize))
    throw Error::mismatch(fmt::format("a number of 0 to {} pixels", kLargestSize), numberText(value));
  return value;
}

// Throws Error unless the value is a whole number of 1 to `most`.
size_t countOf(double value, double most) {
  if (!(value >= 1 && value <= most) || value != std::floor(value))
    throw Error::mismatch(fmt::format("a whole number of 1 to {}", most), numberText(value));
  return static_cast<size_t>(value);
}

} // namespace

std::vector<knobs::Knob> knobsOf(const shading::ReflectanceField& field, const FrameOptions& full) {
  std::vector<knobs::Knob> knobs;
  if (full.shade.nearest) return knobs;
  if (field.hasSeparateWeights()) {
    knobs.push_back({"cameras", "cameras blended per surfel", downToOne(full.shade.cameras)});
    if (!field.rig.lights.empty())
      knobs.push_back({"lights", "captured lights blended per light of the script",
                       downToOne(shading::lightBlend(field, full.shade).lights)});
  } else {
    knobs.push_back({"pairs", "camera-light pairs blended per surfel and light of the script",
                     downToOne(full.shade.pairs)});
  }
  knobs.push_back({"surfel_size",
                   "pixels between neighbouring surfels at least; 0: all surfels",
                   {0, 0.5, 0.7, 1, 1.4, 2, 2.8}});
  knobs.push_back({"patch", "surfels that share the weights of cameras and lights", {1, 2, 4, 8, 16}});
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
      if (knob.name == "pairs") options.shade.pairs = countOf(value, knob.values.front());
      if (knob.name == "surfel_size") options.surfelSize = sizeOf(value);
      if (knob.name == "patch") options.surfelsPerPatch = countOf(value, kLargestPatch);
    } catch (Error& error) {
      throw std::move(error).at(knob.name).at("knob");
    }
  }
  return options;
}

} // namespace surflect::surfels
