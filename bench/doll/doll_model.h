// A model of the size of the paper's doll: as many surfels, views, lights and pixels, written within minutes
// instead of photographed, traced and packed. Surfels, visibility and blocks are made by the program's own
// functions; only the texture of blocks is invented (doll_blocks.h).
#pragma once

#include "srf/capture/camera.h"
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

// A folder's name.
std::string nameOf(const DollSize& size);

// Cameras around the doll, between 15 degrees below and 75 above, whose pictures show all of it.
std::vector<capture::Camera<AcquisitionSpace>> dollCameras(const DollSize& size);

// About this many surfels on the doll's surface. Throws Cancelled.
SurfelCloud dollCloud(size_t surfels, uint64_t seed = 1, const Progress& progress = {});

// The surfels of a cloud in a random order.
SurfelCloud shuffled(const SurfelCloud& cloud);

// RGB for each surfel, smooth over the surface.
std::vector<float> dollColors(const SurfelCloud& cloud);

// The cloud with its visibility in each camera. Memory: three bytes for each surfel and camera. Throws
// Cancelled.
struct DollSurface {
  SurfelCloud cloud;
  ulr::VisibilityWeights fades;
};
DollSurface dollSurface(size_t surfels, uint64_t seed,
                        std::span<const capture::Camera<AcquisitionSpace>> cameras,
                        const Progress& progress = {});

// Writes the folder that openModel opens. Lights are directional, from all sides. Memory: that of
// dollSurface, and one view's file a thread. Throws Error and Cancelled.
void writeDollModel(const std::filesystem::path& folder, const DollSize& size, const Progress& progress = {});

} // namespace surflect::bench
