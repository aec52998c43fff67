// Evaluates renderings against held-out photographs, or against the ground truth of a deformed object.
#pragma once

#include "render/evaluation/measure.h"
#include "render/surfels/frame.h"
#include "surfel/base/progress.h"

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace surflect::evaluation {

// Baselines, scored by the same protocol.
enum class Baseline {
  nearest, // nearest camera and light; see ShadeOptions::nearest
  lambert, // Lambert surface fitted to the training photographs of the frame's own camera; see lambert_view.h
};

// Renders the frames of one view, given their lights: RGBA, premultiplied.
using Renderer = std::function<image::Image(std::span<const scene::ShotLight> lights)>;

struct EvaluateOptions {
  surfels::FrameOptions frame;
  capture::Split split = capture::Split::test;
  std::set<Baseline> baselines;
  // Further renderers, scored by the same protocol; called once for each view.
  std::vector<std::function<Renderer(const capture::Camera<ObjectSpace>& view)>> others = {};
};

// Errors pooled over frames: the protocol of measure.h, and the linear error on the true mask eroded by two
// pixels.
struct Score {
  Difference difference;
  PooledMean interiorError;
  PooledMean truthNoise; // linear, after exposure; an upper bound (see noiseVariance)
  size_t frames = 0;

  Score& operator+=(const Score& other);
};

struct FrameScore {
  std::string camera, light; // identities
  std::string group;         // known, new_camera, new_light or new_both
  bool frontLit = true;      // true if light and camera are on the same side of the object's centre
  double maskIou = 0;
  Score score;
  std::map<Baseline, Score> baselines;
  std::vector<Score> others; // one per EvaluateOptions::others
};

struct Evaluation {
  // Maps the 99.5th percentile of the true object pixels of all test frames to 1, for any split; of the
  // split's frames if there are no test frames.
  double exposure = 1;
  std::vector<FrameScore> frames;
};

// Renders every frame of the capture's split with its own camera and light, and compares. The cloud is
// deformed by `warp`, which acts in model coordinates; the capture may have another origin. Cameras and
// lights of the model's rig count as known. Throws Error if the split is empty, if no frame has an object
// pixel, or if the Lambert baseline is requested and a camera has no photographs that determine normals.
Evaluation evaluate(const model::Model& model, const capture::Capture& capture, const warp::Warp& warp,
                    const EvaluateOptions& options, codec::BlockCache& cache, const Progress& progress);

} // namespace surflect::evaluation
