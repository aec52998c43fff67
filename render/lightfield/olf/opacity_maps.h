// Opacity light field maps: light field maps of colour and opacity, drawn in visibility order.
//
// [Vlasic 2003, §6] Vlasic et al.: Opacity Light Fields, I3D.
//
// The maps have four channels: roots of r / white, g / white, b / white and alpha, where r, g, b are radiance
// times alpha. Division by white brings all channels to one scale, so that factors fit them equally well.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/olf/opacity_field.h"
#include "srf/capture/capture.h"
#include "surfel/base/time.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <filesystem>

namespace surflect::olf {

struct OpacityMaps {
  lfm::LightFieldMaps maps;
  double white = 1;          // radiance
  Order order = Order::list; // or peel: maps are not drawn by a BSP tree
};

inline constexpr size_t kMapChannels = 4;

// Colour, premultiplied, and opacity at a place in the unit direction d to the viewer, by the mean and the
// first `terms` terms, with the corrections of edges as radianceAt() has them. The sum of terms can be above
// 1 for opaque places; opacity is at most 1. Maps of coding `bytes`.
inline Eigen::Vector4d colorAt(const OpacityMaps& maps, const lfm::TrianglePlace& place,
                               const lfm::Direction& d, size_t terms,
                               const lfm::EdgeCorrections& edges = {}) {
  Eigen::Vector4d color = lfm::radianceAt(maps.maps, place, d, terms, edges);
  color.head<3>() *= maps.white;
  color[3] = std::min(color[3], 1.0);
  return color;
}

// Opacity light field maps on disk: a folder of light_field_folder.h, of format "surflect opacity light field
// maps", specified in docs/format.md.
inline constexpr const char* kMapFormat = "surflect opacity light field maps";
inline constexpr int kMapVersion = 2;

// Takes over a folder as LightFieldWriter does. The capture's training views are those that the maps were
// made of. Throws Error and Cancelled.
void writeMaps(const OpacityMaps& maps, const capture::Capture& capture, const std::filesystem::path& folder,
               const Progress& progress = {});

// Likewise for maps with the mesh and the views of a finished folder, whose files are copied.
void writeMaps(const OpacityMaps& maps, const lightfield::LightFieldFolder& source,
               const std::filesystem::path& folder, const Progress& progress = {});

// Reads maps. Throws Error naming file and field for a folder that is damaged or of another format, and
// Cancelled.
OpacityMaps readMaps(const lightfield::LightFieldFolder& folder, const Progress& progress = {});

} // namespace surflect::olf
