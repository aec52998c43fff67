// Interpolation: which weights answer a query.
//
//   lights of the query      capture         paper, separate, nearest         kriging
//   none: fixed illumination                 cameras                          cameras
//   directional, point       full product    cameras and lights apart         kriging of pairs
//   directional, point       with gaps       ULR of photographed pairs        kriging of photographed pairs
//   environments             full product    cameras and lights apart         cameras and lights apart
//   environments             with gaps       ULR of photographed pairs        ULR of photographed pairs
//
// A full product has a photograph of every camera under every light. Cameras: camera_weights.h, lights:
// light_weights.h, pairs: pair_weights.h. Shared interpolation answers directional and point lights by tables
// as far as they are trusted (shared_weights.h), and else as separate or kriging. It answers environments as
// kriging does, then corrects them by tables (environment_tables.h).
#pragma once

#include "srf/weights/light_blend.h"

#include <array>
#include <cstddef>
#include <string_view>

namespace surflect::weights {

struct ReflectanceField;
struct ShadeOptions;
struct QueryBatch;

// How photographs are weighted for a surfel, a direction to the viewer and a light.
enum class Interpolation {
  paper,    // cameras and lights each by their own angle  [Weyrich 2005, §5.2]
  separate, // likewise, with the model's light blend, and surfels weighted by confidence
  kriging,  // kriging over (camera, light) pairs (kriging.h)
  shared,   // tables shared over the surface, corrected by photographs (shared_weights.h)
};

constexpr std::string_view nameOf(Interpolation interpolation) {
  constexpr std::array<std::string_view, 4> kNames{"paper", "separate", "kriging", "shared"};
  return kNames[static_cast<size_t>(interpolation)];
}

// How the photographs of a model are weighted, unless options say otherwise.
struct InterpolationChoice {
  Interpolation kind = Interpolation::separate;
  float halfScale = 0.2f;  // of half vectors under kriging (KrigingScales)
  bool reciprocal = false; // under kriging, photographs also answer for camera and light exchanged
  // Under kriging, whether shadow states are used (shadow_state.h). Wrong where light passes through the
  // object.
  bool shadows = true;
  // Under shared, separate or kriging: what answers where tables do not.
  Interpolation otherwise = Interpolation::kriging;

  friend bool operator==(const InterpolationChoice&, const InterpolationChoice&) = default;
};

// The interpolation that the options ask for, or else the model's.
Interpolation interpolationOf(const ReflectanceField& field, const ShadeOptions& options);

// The light blend that the options ask for, or else the model's.
LightBlend lightBlend(const ReflectanceField& field, const ShadeOptions& options);

// Number of (camera, light) pairs to blend: that of the options, or else six under kriging and four under
// ULR. Six move highlights more smoothly than four; ULR hardly gains by them.
size_t pairCount(const ReflectanceField& field, const ShadeOptions& options);

// Number of pairs to blend under ULR, where kriging does not weight them.
size_t ulrPairCount(const ReflectanceField& field, const ShadeOptions& options);

// True if directional and point lights are answered by pairs of cameras and lights: kriging or tables.
bool usesKriging(const ReflectanceField& field, const ShadeOptions& options);

// True if tables answer directional and point lights.
bool usesTables(const ReflectanceField& field, const ShadeOptions& options);

// True if tables correct what photographs say of a batch's environments.
bool correctsEnvironments(const ReflectanceField& field, const QueryBatch& batch,
                          const ShadeOptions& options);

// True if the model's choice is to answer by shadow states, for a field that has them; tables need them.
bool usesShadowStates(const ReflectanceField& field, const ShadeOptions& options);

// True if the rest that tables leave is answered as by separate, not by kriging.
bool isSeparateBesideTables(const ReflectanceField& field, const ShadeOptions& options);

// True if surfels may take the mean of weights that were found near them (QueryBatch::cornerWeights).
bool blendsCorners(const ReflectanceField& field, const ShadeOptions& options);

// True if cameras and lights are weighted apart for directional and point lights.
bool hasSeparateWeights(const ReflectanceField& field, const ShadeOptions& options);

} // namespace surflect::weights
