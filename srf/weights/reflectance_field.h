// A surface reflectance field: surfels, the rig that photographed them, and one reflectance image for each
// view and light.  [Weyrich 2005, §3]
#pragma once

#include "srf/capture/capture.h"
#include "srf/codec/alpha_plane.h"
#include "srf/codec/view_file.h"
#include "srf/reflectance/shared_reflectance.h"
#include "srf/weights/interpolation.h"
#include "srf/weights/light_blend.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/cloud.h"
#include "surfel/level_of_detail.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace surflect::weights {

// Surfels of a model of one view, as corners of squares of the view's pixels; see srf/model/pixel_grid.h.
inline constexpr int kCoarsestGrid = 8; // pixels
struct PixelGrid {
  int step = kCoarsestGrid;  // pixels between corners: 1, 2, 4 or 8
  int columns = 0, rows = 0; // of corners

  size_t corners() const { return static_cast<size_t>(columns) * static_cast<size_t>(rows); }
  // Surfel at pixel (step * column, step * row).
  size_t corner(int column, int row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column);
  }
  friend bool operator==(const PixelGrid&, const PixelGrid&) = default;
};

struct ReflectanceField {
  std::filesystem::path folder;
  uint64_t identity = 0; // hash of all content
  capture::Capture rig;  // training views and lights only
  SurfelCloud cloud;
  std::optional<LevelsOfDetail> levels;    // of the cloud, if the model stores them
  Point3<AcquisitionSpace, double> middle; // middle of the cloud's bounding box
  VisibilityWeights visibility;            // one per surfel and view
  // One per surfel and light (shadow_state.h), if the model stores them.
  std::optional<VisibilityWeights> lightVisibility;
  std::vector<codec::ViewFile> files;   // reflectance images, one file for each view of the rig
  std::vector<codec::AlphaPlane> alpha; // one for each view; empty: the object is opaque
  // For each view, the light of each column; empty for fixed illumination.
  std::vector<std::vector<uint32_t>> columns;
  // Tables, and how each surfel uses them; empty if none were made.
  std::optional<reflectance::SharedReflectance> shared;
  double white = 1;     // radiance of a white pixel
  double tolerance = 0; // error tolerance of every block; see blockErrorBound
  // Selected when the photographs were packed.
  LightBlend lightBlend;
  InterpolationChoice interpolation;

  // True if every view has every light, in the order of the rig; cameras and lights are then weighted
  // separately.
  bool isFullProduct = false;
  bool hasNearPairs = false; // nearest_pairs.h; true of a full product

  std::optional<PixelGrid> grid; // of a model of one view, whose pixels are drawn one by one
};

} // namespace surflect::weights
