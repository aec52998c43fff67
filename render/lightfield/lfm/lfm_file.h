// Light field maps on disk: a folder of light_field_folder.h, of format "surflect light field maps",
// specified in docs/format.md.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/lfm/maps.h"
#include "srf/capture/capture.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace surflect::lfm {

inline constexpr const char* kFormatTag = "surflect light field maps";
inline constexpr int kFormatVersion = 3;
inline constexpr const char* kMapsFile = "maps.bin";

// Content of maps.bin.
std::vector<std::byte> mapsBytes(const LightFieldMaps& maps);
// Reads the content of maps.bin for a mesh, and maps of so many channels. Throws Error naming the field for
// bytes that are no such file.
LightFieldMaps parseMaps(std::span<const std::byte> bytes, TriangleMesh mesh, size_t channels = 3);
// Maps of so many channels of a folder of any format. Throws Error with file and field, and Cancelled.
LightFieldMaps readMaps(const lightfield::LightFieldFolder& folder, size_t channels,
                        const Progress& progress = {});

// Numbers of all manifests of maps.
lightfield::Numbers numbersOf(const LightFieldMaps& maps);

// Writes a folder, which must be missing, empty or a light field. The capture's training views are those that
// the maps were made of. Throws Error and Cancelled.
void writeMaps(const LightFieldMaps& maps, const capture::Capture& capture,
               const std::filesystem::path& folder, const Progress& progress = {});
// Likewise for maps with the mesh and the views of a finished folder, whose files are copied.
void writeMaps(const LightFieldMaps& maps, const lightfield::LightFieldFolder& source,
               const std::filesystem::path& folder, const Progress& progress = {});

struct OpenedMaps {
  lightfield::LightFieldFolder folder;
  LightFieldMaps maps;
};
// Reads a folder. Throws Error with file and field for one that is damaged or of another format, and
// Cancelled.
OpenedMaps openMaps(const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::lfm
