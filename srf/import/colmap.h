// COLMAP's sparse models, text and binary.
//
// Cameras look along +z with y down; poses are camera from world; the first pixel's centre is at (0.5, 0.5).
// [https://colmap.github.io/format.html, https://colmap.github.io/cameras.html]
#pragma once

#include "srf/import/source.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

namespace surflect {

// The folder with cameras.bin or cameras.txt: this one, or where COLMAP's tools put it below; none: empty.
std::optional<std::filesystem::path> findColmapModel(const std::filesystem::path& folder);

// Every registered picture is a view of its own, under fixed light; masks/NAME.png beside the images folder
// are masks, as COLMAP itself takes them. images: where the names start; empty: folder/images. Models known:
// SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, and FULL_OPENCV where its k3 to k6 are 0. Throws
// Error.
Source readColmap(const std::filesystem::path& folder, const std::filesystem::path& images,
                  bool allowOutside);

// The lens of a model by COLMAP's name and order of parameters; throws Error that names the model.
Lens colmapLens(std::string_view model, int width, int height, std::span<const double> parameters);

} // namespace surflect
