// How long the stages of a frame take, and how much they have to do.
#pragma once

#include "bench/doll/stage_bounds.h"
#include "bench/timing/laps.h"
#include "render/surfels/frame.h"

#include <map>
#include <span>
#include <string>
#include <vector>

namespace surflect::bench {

// A model bent and lit for measuring.
struct Shot {
  warp::WarpPointer warp;
  capture::Camera<ObjectSpace> camera;
  std::vector<scene::ShotLight> lights;
  surfels::FrameOptions options;
};

// The model twisted by 40 degrees about z over its largest side, all of it seen from before (-y) and a little
// above on a picture of this size, under point lights from all around; 4 views and 4 captured lights blended,
// their mean.
Shot dollShot(const model::Model& model, int width, int height, size_t lights);

// Takes the view files out of the page cache; their next reader waits for the disk.
void forgetFiles(const model::Model& model);

struct FrameTimes {
  FrameCounts counts;
  double coldSeconds = 0;  // of a frame whose blocks come from the disk
  double firstSeconds = 0; // of one that finds the cache empty, but the files in memory
  Times frame;             // of those that find everything in the cache
  std::map<std::string, Times, std::less<>> stages; // for each of kStages
};

// Times frames of one shot, whose blocks are all in memory after the first; between two of them others may
// have their turn. Stages are those of renderFrame; its ULR is split as planning does with and without
// lights.
class FrameTimer {
public:
  // Renders the first frame. All of them must outlive this; the cache is empty, and of the model's files.
  // `runs` of planning tell what the choice of views has of ULR.
  FrameTimer(const model::Model& model, const Shot& shot, codec::BlockCache& cache, int runs);

  void lap();               // one frame
  FrameTimes times() const; // of laps so far, one or more; no cold frame

  std::span<const Lap> frames() const { return frames_; }
  std::span<const Lap> lookUps() const { return ofStage_.find("look-up")->second; }

private:
  void render(surfels::FrameStats& stats);

  const model::Model& model_;
  const Shot& shot_;
  codec::BlockCache& cache_;
  surfels::FrameMemory memory_; // as in a film whose frames are written as they come
  FrameCounts counts_;
  double firstSeconds_ = 0, ofViews_ = 0;
  std::vector<Lap> frames_;
  std::map<std::string, std::vector<Lap>, std::less<>> ofStage_; // of renderFrame
};

// The cache is empty, and of the model's files. For the cold frame the system is asked to forget these and
// another cache of `cacheBytes` is filled.
FrameTimes timeFrames(const model::Model& model, const Shot& shot, codec::BlockCache& cache,
                      size_t cacheBytes, int frames);

} // namespace surflect::bench
