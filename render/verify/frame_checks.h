// Checks of one frame: its warp, the photographs that are blended, its directions, weights and pixels.
#pragma once

#include "render/surfels/frame.h"
#include "render/verify/check.h"
#include "srf/image/image.h"
#include "srf/model/model.h"
#include "surfel/base/time.h"

#include <array>
#include <string_view>
#include <vector>

namespace surflect::verify {

// Reasons for which surfels are coloured in the overlay, the gravest first.
struct FlagColor {
  std::string_view rule, meaning, color; // colour as #rrggbb
};
inline constexpr std::array<FlagColor, 5> kFlagColors = {
    {{"folded", "folded over", "#cc33cc"},
     {"unseen", "answered by views that do not see it", "#e8432e"},
     {"shadows_unmatched", "no photograph of this shadow state", "#2aa876"},
     {"lights_extrapolated", "no captured light near", "#3b8fe8"},
     {"views_extrapolated", "no captured camera near", "#eba63a"}}};

struct FrameFindings {
  std::vector<Check> checks;
  // The frame in grey, encoded by sRGB, with flagged surfels in colour and the places of broken checks ringed
  // and numbered in the order of `checks`. Magnified if it is small.
  image::Image overlay;
};

// Renders the frame and checks it. All surfels are drawn, each with weights of its own, whatever the options
// say. Of a model with a pixel grid, pixels are those that are drawn, and the checks of surfels are made at
// the corners of the grid that splats would show. Throws Error as renderFrame, and Cancelled.
FrameFindings frameChecks(const model::Model& model, const scene::Scene& scene, surfels::FrameOptions options,
                          surfels::FrameWorkspace& workspace, const Bounds& bounds,
                          const Progress& progress = {});

} // namespace surflect::verify
