// A packed surface reflectance field in a folder: manifest.json (version, white level, light blend,
// checksums), transforms.json (the rig), surfels.ply, levels.bin, fades.bin, shadows.bin,
// tables.bin where surfels share reflectance, views/*.srfb, and views/*.srfa where alpha matters.
//
// The rig has the form of a capture whose pictures are the view files: the frames of a view, in order, are
// the columns of its file. Specified in docs/format.md.
#pragma once

#include "srf/weights/reflectance_field.h"
#include "surfel/base/time.h"

#include <filesystem>
#include <optional>

namespace surflect::model {

using Model = weights::ReflectanceField;

// Opens a packed model. Throws Error naming file and field, and Cancelled.
Model openModel(const std::filesystem::path& folder, const Progress& progress = {});

// Content of a model from which the rest follows.
struct ModelContent {
  capture::Capture rig;
  SurfelCloud cloud;
  weights::VisibilityWeights visibility;
  double white, tolerance;
  weights::LightBlend lightBlend;
  bool hasAlpha = false;                       // whether the folder has an alpha file for each view
  std::optional<weights::PixelGrid> grid = {}; // of the cloud
};

// Makes a model in a folder that has its view and alpha files already: with levels of detail, shadow states
// (not with a grid) and open files, but without identity, as it has not been written. Throws Error as
// ViewFile, and Cancelled.
Model makeModel(const std::filesystem::path& folder, ModelContent content, const Progress& progress = {});

// Writes a model into its folder, which has the view and alpha files already. The manifest is written last: a
// folder without one is unfinished. Throws Error and Cancelled.
void writeModel(const Model& model, const Progress& progress = {});

// Median distance of neighbouring surfels in pixels of the rig's pictures, as the middle of the cloud is
// seen. Two across a pixel are 0.5; from 1 on, details blur. The cloud is not empty.
double pixelsBetween(const SurfelCloud& cloud, const capture::Capture& rig);

// Returns views/0007.srfb for view 7.
std::filesystem::path viewFilePath(size_t view);
// Returns views/0007.srfa for view 7.
std::filesystem::path alphaFilePath(size_t view);

} // namespace surflect::model
