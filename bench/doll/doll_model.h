// A model as large as the paper's doll: as many surfels, views, lights and pixels, generated within minutes
// without photographing, path tracing or packing. Surfels, visibility and blocks are computed by the
// program's own functions; only the texture of blocks is synthetic (doll_blocks.h).
#pragma once

#include "srf/capture/camera.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/base/time.h"
#include "surfel/cloud.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace surflect::bench {

// Size of the paper's doll [Weyrich 2005, §6].
struct DollSize {
  size_t surfels = 532'935; // approximate
  size_t views = 432, lights = 60;
  int width = 1032, height = 1360; // pixels
  uint64_t seed = 1;
};

// Folder name of a model of this size.
std::string nameOf(const DollSize& size);

// Cameras around the doll, from 15 degrees below to 75 above, that see all of it.
std::vector<capture::Camera<AcquisitionSpace>> dollCameras(const DollSize& size);

// Samples about this many surfels on the doll's surface. Throws Cancelled.
SurfelCloud dollCloud(size_t surfels, uint64_t seed = 1, const Progress& progress = {});

// The surfels of a cloud in random order.
SurfelCloud shuffled(const SurfelCloud& cloud);

// RGB of each surfel, smooth over the surface.
std::vector<float> dollColors(const SurfelCloud& cloud);

// A cloud with its visibility in each camera. Memory: three bytes for each surfel and camera.
struct DollSurface {
  SurfelCloud cloud;
  weights::VisibilityWeights visibility;
};
DollSurface dollSurface(size_t surfels, uint64_t seed,
                        std::span<const capture::Camera<AcquisitionSpace>> cameras,
                        const Progress& progress = {});

// Writes a model folder, with directional lights from all sides. Memory: that of dollSurface, and one view
// file for each thread. Throws Error and Cancelled.
void writeDollModel(const std::filesystem::path& folder, const DollSize& size, const Progress& progress = {});

} // namespace surflect::bench
