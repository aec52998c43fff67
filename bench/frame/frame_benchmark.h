// Benchmarks of whole frames.
#pragma once

#include "bench/doll/doll_shot.h"
#include "bench/frame/stage_bounds.h"
#include "render/surfels/reference.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace surflect::bench {

// A model and a shot whose frame is rendered repeatedly. All blocks are in memory after the first frame.
class WarmFrame {
public:
  // Renders the first frame.
  WarmFrame(std::shared_ptr<const model::Model> model, Shot shot);

  const surfels::FrameLayers& render(); // valid until the next call
  const surfels::FrameStats& last() const { return workspace_.stats; }
  const surfels::FrameStats& first() const { return first_; } // includes the blocks read from disk
  const Shot& shot() const { return shot_; }
  const model::Model& model() const { return *model_; }
  codec::BlockCache& cache() { return workspace_.cache; }

private:
  std::shared_ptr<const model::Model> model_;
  Shot shot_;
  surfels::FrameWorkspace workspace_;
  surfels::FrameStats first_;
};

FrameCounts countsOf(const WarmFrame& frame);

// Drops the view files from the page cache.
void forgetFiles(const model::Model& model);

// A frame timed under one name, with its statistics for each repetition.
struct FrameBenchmark {
  std::string name;                                 // growth/WHAT/SIZE, or "frame"
  std::string what;                                 // quantity that grows; empty for "frame"
  double size = 0;                                  // value of that quantity
  std::function<std::unique_ptr<WarmFrame>()> make; // called when the benchmark first runs
  std::unique_ptr<WarmFrame> frame = nullptr;
  std::vector<surfels::FrameStats> stats = {};
};

// Frames with `lights` lights and all views, each with one quantity changed: a quarter and half of the views;
// four times the pixels; 1 and 60 lights, and an environment. Surfels are 1, 2 and 4 times as many, with a
// quarter of the views.
std::vector<FrameBenchmark> growthBenchmarks(std::shared_ptr<const model::Model> model, int width, int height,
                                             size_t lights);

} // namespace surflect::bench
