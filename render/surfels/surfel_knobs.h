// Knobs of the surfel renderer.
#pragma once

#include "render/knobs/knob.h"
#include "render/surfels/frame.h"

#include <functional>
#include <optional>
#include <vector>

namespace surflect::surfels {

// A knob, and what a value of it does to the options. Throws Error for a value that the knob cannot have.
struct SurfelKnob {
  knobs::Knob knob;
  std::optional<double> preview; // value in the preview setting, if that is not the most accurate
  std::function<void(double value, FrameOptions& options)> apply;
};

// The knobs that apply to frames of a field with the given options, which are their most accurate values.
std::vector<SurfelKnob> knobsOf(const shading::ReflectanceField& field, const FrameOptions& full);

// The preview setting.
knobs::Setting previewOf(const std::vector<SurfelKnob>& knobs);

// The options of a setting, whose knobs must all exist. Throws Error naming the knob.
FrameOptions turned(const FrameOptions& full, const std::vector<SurfelKnob>& knobs,
                    const knobs::Setting& setting);

} // namespace surflect::surfels
