// How long the stages of a frame take, and how much they have to do.
#pragma once

#include "bench/doll/stage_bounds.h"
#include "bench/timing/laps.h"
#include "render/frame.h"

#include <map>
#include <string>
#include <vector>

namespace surflect {

// A model bent and lit for measuring.
struct Shot {
  WarpPointer warp;
  Camera<ObjectSpace> camera;
  std::vector<ShotLight> lights;
  FrameOptions options;
};

// The model twisted by 40 degrees about z over its largest side, all of it seen from before (-y) and a little
// above on a picture of this size, under point lights from all around; 4 views and 4 captured lights blended,
// their mean.
Shot dollShot(const Model& model, int width, int height, size_t lights);

// Takes the view files out of the page cache; their next reader waits for the disk.
void forgetFiles(const Model& model);

struct FrameTimes {
  FrameCounts counts;
  double coldSeconds = 0;  // of a frame whose blocks come from the disk
  double firstSeconds = 0; // of one that finds the cache empty, but the files in memory
  Times frame;             // of those that find everything in the cache
  std::map<std::string, Times, std::less<>> stages; // for each of kStages
};

// The cache is empty, and of the model's files. For the cold frame the system is asked to forget these and
// another cache of `cacheBytes` is filled. Stages are those of renderFrame; its ULR is split as planning does
// with and without lights.
FrameTimes timeFrames(const Model& model, const Shot& shot, BlockCache& cache, size_t cacheBytes, int frames);

} // namespace surflect
