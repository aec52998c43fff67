// Evaluates renderings against held-out photographs, or against the ground truth of a deformed object.
#pragma once

#include "render/evaluation/measure.h"
#include "render/evaluation/tile_errors.h"
#include "render/method/renderer.h"
#include "render/scene/scene.h"
#include "surfel/base/progress.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::evaluation {

struct EvaluateOptions {
  capture::Split split = capture::Split::test;
  std::vector<scene::ShotLight> lights = {}; // light photographs that name no light, as new lights
  // Renderers of the same model that are scored by the same protocol, by name.
  std::map<std::string, method::Renderer*> others = {};
  // Whether to score, under the name "lambert", a Lambert surface fitted to the training photographs of the
  // frame's own camera; see lambert_view.h.
  bool lambert = false;
  // Whether to compare the renderer's AOV predicted_error, which it must have, with the true errors.
  bool confidence = false;
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
  // Whether light and camera are on the same side of the object's centre. Empty for a frame that names no
  // light.
  std::optional<bool> frontLit;
  double maskIou = 0;
  size_t invalidTexels = 0; // of the photograph: NaN or infinite, in no score
  Score score;
  std::map<std::string, Score> others; // by name
  TileErrors tiles;                    // empty unless confidence is asked for
};

struct Evaluation {
  double exposure = 1; // as TrueFrames::exposure
  std::vector<FrameScore> frames;
};

// Renders every frame of the capture's split with its own camera and light, and compares; options.lights
// light frames that name none. The object is deformed by `warp`, which acts in model coordinates; the capture
// may have another origin. Cameras and lights of the model's rig count as known. Throws Error if the split is
// empty, if no frame has an object pixel, if the Lambert surface is requested and a camera has no photographs
// that determine normals, or if confidence is requested of a renderer without it.
Evaluation evaluate(method::Renderer& renderer, const capture::Capture& capture, const warp::Warp& warp,
                    const EvaluateOptions& options = {}, const Progress& progress = {});

} // namespace surflect::evaluation
