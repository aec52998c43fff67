// Knobs of the surfel renderer.
#pragma once

#include "render/knobs/knob.h"
#include "render/surfels/frame.h"

#include <vector>

namespace surflect::surfels {

// The knobs that apply to frames of a field with the given options, which are their most accurate values.
std::vector<knobs::Knob> knobsOf(const shading::ReflectanceField& field, const FrameOptions& full);

// The options of a setting. Throws Error as Renderer::turn.
FrameOptions turned(const FrameOptions& full, const std::vector<knobs::Knob>& knobs,
                    const knobs::Setting& setting);

} // namespace surflect::surfels
