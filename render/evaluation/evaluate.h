// Evaluates renderings against held-out photographs, or against the ground truth of a deformed object.
#pragma once

#include "render/evaluation/measure.h"
#include "render/method/renderer.h"
#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/proxy/relief/photometric.h"
#include "surfel/base/time.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::evaluation {

// Lambert baseline: albedo and normals fitted to the training photographs of one camera.
class LambertView {
public:
  // Fits the training photographs taken from `view`, under directional or point lights. The last channel of
  // `object` is the view's alpha, used if the photographs have no matte. Throws Error if there are no such
  // photographs or their lights do not determine normals, and Cancelled.
  LambertView(const capture::Capture& training, const capture::View& view, const image::Image& object,
              const Progress& progress);

  // Renders the view under another light: RGBA, premultiplied.
  image::Image under(const capture::Light& light) const;

private:
  capture::Camera<AcquisitionSpace> camera_;
  image::Image alpha_; // 1 channel
  relief::LambertImage fits_;
};

// True and predicted errors of a picture, tile by tile, by which a prediction of errors is judged.
inline constexpr int kTileSize = 16; // pixels
// Least part of a tile that object pixels of either image cover.
inline constexpr double kTileCover = 0.25;

// Root mean squares over the object pixels of each tile, in row order.
struct TileErrors {
  std::vector<double> measured, predicted; // errors
  std::vector<double> brightness;          // of the rendered colour: the simplest prediction

  TileErrors& operator+=(const TileErrors& other) {
    measured.insert(measured.end(), other.measured.begin(), other.measured.end());
    predicted.insert(predicted.end(), other.predicted.begin(), other.predicted.end());
    brightness.insert(brightness.end(), other.brightness.begin(), other.brightness.end());
    return *this;
  }
};

// Errors divided by brightness, for the tiles that are not black. They show what a prediction knows beyond
// "brighter is worse".
TileErrors relativeErrors(const TileErrors& tiles);

// Tile errors by the protocol of measure.h, in linear light: `truth` and `rendered` are linear RGBA,
// premultiplied; `predicted` is the RMS error of each pixel over its three channels, before the exposure. All
// have one size.
TileErrors tileErrors(const image::Image& truth, const image::Image& rendered, const image::Image& predicted,
                      double exposure);

struct EvaluateOptions {
  capture::Split split = capture::Split::test;
  std::vector<scene::ShotLight> lights = {}; // light photographs that name no light, as new lights
  // Renderers of the same model that are scored by the same protocol, by name.
  std::map<std::string, method::Renderer*> others = {};
  // Whether to score, under the name "lambert", a Lambert surface fitted to the training photographs of the
  // frame's own camera.
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

// Signs that a capture is not one of a model's object in the same rig and scale, one line each: cameras or
// lights that differ from those of the same name, or training cameras none of which the model knows.
std::vector<std::string> rigMismatches(const method::Description& model, const capture::Capture& capture);

// Line for people if the silhouettes of most frames overlap those of the photographs badly.
std::optional<std::string> silhouetteMismatch(const Evaluation& evaluation);

} // namespace surflect::evaluation
