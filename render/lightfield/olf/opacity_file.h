// Opacity light fields on disk: a folder of light_field_folder.h, of format "surflect opacity light field",
// specified in docs/format.md.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/olf/opacity_field.h"
#include "srf/capture/capture.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <filesystem>
#include <span>

namespace surflect::olf {

inline constexpr const char* kFormat = "surflect opacity light field";
inline constexpr int kVersion = 1;

// Takes over a folder as LightFieldWriter does. The field's views are the capture's training views. Throws
// Error and Cancelled.
void writeField(const OpacityField& field, const capture::Capture& capture,
                const std::filesystem::path& folder, const Progress& progress = {});

// Reads a field. Throws Error naming the file and field if a number is out of range, a view does not exist,
// lies outside its layer or is no plain pinhole, or a texel is not finite; and Cancelled.
OpacityField readField(const lightfield::LightFieldFolder& folder, const Progress& progress = {});

// Reads the content of views.bin into a field that has its mesh, its cameras and the size of a layer. Throws
// Error naming the field as readField() does.
void parseViews(std::span<const std::byte> bytes, OpacityField& field);
// Reads blocks.bin into views of parseViews(), whose layers are whole blocks. Throws Error naming the file,
// likewise; and Cancelled.
void readBlocks(const OpenFile& file, PackedViews& packed, const Progress& progress = {});

} // namespace surflect::olf
