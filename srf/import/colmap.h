// COLMAP's sparse models, text and binary.
//
// Cameras look along +z with y down; poses are camera from world; the first pixel's centre is at (0.5, 0.5).
// [https://colmap.github.io/format.html, https://colmap.github.io/cameras.html]
#pragma once

#include "srf/import/foreign_capture.h"

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Folders with cameras.bin or cameras.txt: the given one, and those below where COLMAP's tools put models.
// Folders without images.bin and images.txt are returned only if none has either.
std::vector<std::filesystem::path> findColmapModels(const std::filesystem::path& folder);

// Reads the largest model; every registered picture is a view of its own, under fixed light. `images` is the
// folder that names are relative to; empty: folder/images. Models: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL,
// RADIAL, OPENCV, and FULL_OPENCV with k4 to k6 equal to 0. Throws Error.
ForeignCapture readColmap(const std::filesystem::path& folder, const std::filesystem::path& images,
                          bool allowOutside);

// Lens of a COLMAP camera model, with parameters in COLMAP's order. Throws Error naming an unsupported model.
capture::Lens colmapLens(std::string_view model, int width, int height, std::span<const double> parameters);

} // namespace surflect::importers
