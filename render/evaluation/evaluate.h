// How near renderings come to photographs that were kept back, or to the truth of a deformed object.
#pragma once

#include "render/evaluation/measure.h"
#include "render/surfels/frame.h"
#include "srf/model/model.h"
#include "surfel/base/progress.h"

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace surflect::evaluation {

// What renderings are held against, by the same protocol.
enum class Baseline {
  nearest, // the nearest camera and light, see ShadeOptions::nearest
  lambert, // a Lambert surface fitted to the training photographs of the frame's own camera, see
           // lambert_view.h
};

// A way to render the frames of one view, by their lights: RGBA, premultiplied.
using Renderer = std::function<image::Image(std::span<const scene::ShotLight> lights)>;

struct EvaluateOptions {
  surfels::FrameOptions frame;
  capture::Split split = capture::Split::test;
  std::set<Baseline> baselines;
  // Further ways, scored by the same protocol; one is made for each view.
  std::vector<std::function<Renderer(const capture::Camera<ObjectSpace>& view)>> others = {};
};

// Pooled over frames: the protocol of measure.h, and the linear error on the true mask eroded by two pixels.
struct Score {
  Difference difference;
  PooledMean interiorError;
  PooledMean truthNoise; // linear, after exposure; an upper bound, see noiseVariance
  size_t frames = 0;

  Score& operator+=(const Score& other);
};

struct FrameScore {
  std::string camera, light; // identities
  std::string group;         // known, new_camera, new_light or new_both
  bool frontLit = true;      // light and camera on one side of the object's centre
  double maskIou = 0;
  Score score;
  std::map<Baseline, Score> baselines;
  std::vector<Score> others; // one per EvaluateOptions::others
};

struct Evaluation {
  double exposure = 1; // maps the 99.5th percentile of the true object pixels of all test frames to 1,
                       // whatever the split; those of the split where there are no test frames
  std::vector<FrameScore> frames;
};

// Renders every frame of the capture's split with its own camera and light, the cloud bent by `warp`, which
// acts in the coordinates of the model; those of the capture may count from another origin. Known
// cameras and lights are those of the model's rig. Throws Error where the split is empty, where no frame has
// a pixel of an object, and where the Lambert baseline is asked for but a camera has no photographs that tell
// normals.
Evaluation evaluate(const model::Model& model, const capture::Capture& capture, const warp::Warp& warp,
                    const EvaluateOptions& options, codec::BlockCache& cache, const Progress& progress);

} // namespace surflect::evaluation
