// A packed surface reflectance field on disk.
//
// On disk a folder: manifest.json (version, white level, light blend, checksums), transforms.json (the rig,
// in the form of a capture whose pictures are the view files: the frames of a view, in order, are the columns
// of its file), surfels.ply, fades.bin and views/*.srfb. Specified in docs/format.md.
#pragma once

#include "srf/shading/reflectance_field.h"
#include "surfel/base/progress.h"

#include <filesystem>

namespace surflect::model {

using Model = shading::ReflectanceField;

// Throws Error naming file and field, and Cancelled.
Model openModel(const std::filesystem::path& folder, const Progress& progress = {});

// What openModel reads beside the view files, which must be in place already. Written last, so that a folder
// without manifest is an unfinished one.
struct ModelContent {
  const capture::Capture& rig;
  const SurfelCloud& cloud;
  const ulr::VisibilityWeights& fades;
  double white, tolerance;
  ulr::LightBlend lightBlend;
};
void writeModel(const std::filesystem::path& folder, const ModelContent& content,
                const Progress& progress = {});

// views/0007.srfb
std::filesystem::path viewFilePath(size_t view);

} // namespace surflect::model
