// COLMAP's sparse models, text and binary.
//
// Cameras look along +z with y down; poses are camera from world; the first pixel's centre is at (0.5, 0.5).
// [https://colmap.github.io/format.html, https://colmap.github.io/cameras.html]
#pragma once

#include "srf/import/source.h"

#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace surflect::importers {

// The folders with cameras.bin or cameras.txt: this one, and those where COLMAP's tools put models below.
std::vector<std::filesystem::path> findColmapModels(const std::filesystem::path& folder);

// Every registered picture of the largest model is a view of its own, under fixed light. images: where the
// names start; empty: folder/images. Models known: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV,
// and FULL_OPENCV where its k3 to k6 are 0. Throws Error.
Source readColmap(const std::filesystem::path& folder, const std::filesystem::path& images,
                  bool allowOutside);

// The lens of a model by COLMAP's name and order of parameters; throws Error that names the model.
capture::Lens colmapLens(std::string_view model, int width, int height, std::span<const double> parameters);

} // namespace surflect::importers
