// A packed surface reflectance field in a folder: manifest.json (version, white level, light blend,
// checksums), transforms.json (the rig), surfels.ply, levels.bin, fades.bin, shadows.bin
// and views/*.srfb.
//
// The rig has the form of a capture whose pictures are the view files: the frames of a view, in order, are
// the columns of its file. Specified in docs/format.md.
#pragma once

#include "srf/shading/reflectance_field.h"
#include "surfel/base/progress.h"

#include <filesystem>

namespace surflect::model {

using Model = shading::ReflectanceField;

// Opens a packed model. Throws Error naming file and field, and Cancelled.
Model openModel(const std::filesystem::path& folder, const Progress& progress = {});

// Content of a model apart from its view files, which must exist already. Levels of detail are built from the
// cloud. The manifest is written last: a folder without one is unfinished.
struct ModelContent {
  const capture::Capture& rig;
  const SurfelCloud& cloud;
  const ulr::VisibilityWeights& visibility;
  double white, tolerance;
  ulr::LightBlend lightBlend;
};
void writeModel(const std::filesystem::path& folder, const ModelContent& content,
                const Progress& progress = {});

// Returns views/0007.srfb for view 7.
std::filesystem::path viewFilePath(size_t view);

} // namespace surflect::model
