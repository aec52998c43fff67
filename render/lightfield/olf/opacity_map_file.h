// Opacity light field maps on disk: a folder of light_field_folder.h, of format "surflect opacity light field
// maps", specified in docs/format.md.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "srf/capture/capture.h"
#include "surfel/base/progress.h"

#include <filesystem>

namespace surflect::olf {

inline constexpr const char* kMapFormat = "surflect opacity light field maps";
inline constexpr int kMapVersion = 1;

// Takes over a folder as LightFieldWriter does. The capture's training views are those that the maps were
// made of. Throws Error and Cancelled.
void writeMaps(const OpacityMaps& maps, const capture::Capture& capture, const std::filesystem::path& folder,
               const Progress& progress = {});

// Reads maps. Throws Error naming file and field for a folder that is damaged or of another format, and
// Cancelled.
OpacityMaps readMaps(const lightfield::LightFieldFolder& folder, const Progress& progress = {});

} // namespace surflect::olf
