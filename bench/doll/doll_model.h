// A model of the shape of the paper's doll: as many surfels, views, lights and pixels, written within minutes
// instead of photographed, traced and packed. What a frame does with it is what it would do with a captured
// one: surfels are sampled, visibility and fades computed, blocks encoded by the same functions; only where a
// block's texture comes from is made up (doll_blocks.h).
#pragma once

#include "srf/capture/capture.h"
#include "srf/ulr/visibility_weights.h"
#include "surfel/base/progress.h"
#include "surfel/cloud.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace surflect::bench {

// [Weyrich 2005, §6]
struct DollSize {
  size_t surfels = 532'935; // about
  size_t views = 432, lights = 60;
  int width = 1032, height = 1360; // pixels
  uint64_t seed = 1;
};

// As a name of a folder.
std::string nameOf(const DollSize& size);

// Is the rig that of a model written here?
bool isDoll(const capture::Capture& rig);

// Stand around the doll, between 15 degrees below and 75 above, and have all of it in their pictures.
std::vector<capture::Camera<AcquisitionSpace>> dollCameras(const DollSize& size);

// The doll's surface, and how well each camera sees it.
struct DollSurface {
  SurfelCloud cloud;
  ulr::VisibilityWeights fades;
};
// Of about so many surfels. Memory: three bytes for each surfel and camera. Throws Cancelled.
DollSurface dollSurface(size_t surfels, uint64_t seed,
                        std::span<const capture::Camera<AcquisitionSpace>> cameras,
                        const Progress& progress = {});

// Writes the folder that openModel opens. Lights are directional, from all sides. Memory: that of
// dollSurface, and one view's file a thread. Throws Error and Cancelled.
void writeDollModel(const std::filesystem::path& folder, const DollSize& size, const Progress& progress = {});

} // namespace surflect::bench
