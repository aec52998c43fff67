// A packed surface reflectance field: surfels, the rig that saw them, and reflectance images on disk.
//
// On disk a folder: manifest.json (version, white level, light blend, checksums), transforms.json (the rig,
// in the form of a capture whose pictures are the view files: the frames of a view, in order, are the columns
// of its file), surfels.ply, fades.bin and views/*.srfb. Specified in docs/format.md.
#pragma once

#include "srf/capture/capture.h"
#include "srf/codec/view_file.h"
#include "srf/ulr/light_blend.h"
#include "srf/ulr/visibility_weights.h"
#include "surfel/base/progress.h"
#include "surfel/cloud.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace surflect::model {

struct Model {
  std::filesystem::path folder;
  uint64_t identity = 0; // of all its content
  capture::Capture rig;  // training views and lights only
  SurfelCloud cloud;
  Point3<AcquisitionSpace, double> middle; // of the cloud's box
  ulr::VisibilityWeights fades;
  std::vector<codec::ViewFile> files;         // one per view of the rig
  std::vector<std::vector<uint32_t>> columns; // per view: the light of each column; empty: fixed illumination
  double white = 1;                           // radiance of a white pixel
  double tolerance = 0;                       // of every block
  ulr::LightBlend lightBlend; // which the photographs are best told by, see light_blend_selection.h

  // Does every view hold every light, in the order of the rig? Then cameras and lights are chosen apart.
  bool isFullProduct = false;
};

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
