// How near renderings come to photographs that were kept back, or to the truth of a deformed object.
#pragma once

#include "render/evaluation/measure.h"
#include "render/renderer.h"
#include "surfel/base/progress.h"

#include <map>
#include <string>
#include <vector>

namespace surflect::evaluation {

struct EvaluateOptions {
  capture::Split split = capture::Split::test;
  // Renderers of the same model that are scored by the same protocol, by name.
  std::map<std::string, render::Renderer*> others = {};
  // Whether to score, under the name "lambert", a Lambert surface fitted to the training photographs of the
  // frame's own camera; see lambert_view.h.
  bool lambert = false;
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
  std::map<std::string, Score> others; // by name
};

struct Evaluation {
  double exposure = 1; // maps the 99.5th percentile of the true object pixels of all test frames to 1,
                       // whatever the split; those of the split where there are no test frames
  std::vector<FrameScore> frames;
};

// Renders every frame of the capture's split with its own camera and light, the object bent by `warp`, which
// acts in the coordinates of the model; those of the capture may count from another origin. Known cameras and
// lights are those of the model's rig. Throws Error where the split is empty, where no frame has a pixel of
// an object, and where the Lambert surface is asked for but a camera has no photographs that tell normals.
Evaluation evaluate(render::Renderer& renderer, const capture::Capture& capture, const warp::Warp& warp,
                    const EvaluateOptions& options = {}, const Progress& progress = {});

} // namespace surflect::evaluation
