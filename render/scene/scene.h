// The script at one time: camera, lights and warp as plain values, without any knowledge of a renderer.
#pragma once

#include "render/scene/script.h"
#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"
#include "warp/warp.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace surflect::scene {

// The environments of a script: their pixels, read once for all frames of a shot.
struct Environment {
  std::filesystem::path image;
  std::shared_ptr<const weights::EnvironmentMap> map; // never null
  uint64_t hash = 0;                                  // of the texels
  double seconds = 0;                                 // taken by reading
};

// Environments of scripts, each read once for as long as this lives: scripts that are edited share them.
class Environments {
public:
  // One per environment of the script, in order. Throws Error and Cancelled as readEnvironment does.
  std::vector<Environment> read(const Script& script, const Progress& progress);

private:
  std::map<std::pair<std::filesystem::path, std::optional<weights::EnvironmentMapping>>, Environment> kept_;
};

// Environments::read of one script.
inline std::vector<Environment> readEnvironments(const Script& script, const Progress& progress) {
  return Environments().read(script, progress);
}

// t and s are 0 where the script has no [frames].
warp::ShotTime shotTime(const Script& script, double frame);

// The nearest time of the film. A shutter is open beyond its ends, where a fade has no value.
warp::ShotTime withinFilm(const Script& script, const warp::ShotTime& time);

// folder / output.path with its #### replaced by the frame number, padded with zeros.
std::filesystem::path framePath(const Output& output, const std::filesystem::path& folder, int frame);

// Lens on a picture of the script's size. Throws Error if the lens's own picture has another shape, which is
// that of `owner`: "the camera's pictures".
capture::Lens fittedLens(const capture::Lens& lens, const Script& script, std::string_view owner);

// Camera of a script that has an output and no NamedCamera. Throws Error if a track is not finite, if the
// viewing direction is zero or along `up`, if fov_deg is outside 0.001..179.999, and as fittedLens does.
capture::Camera<ObjectSpace> cameraAt(const Script& script, const warp::ShotTime& time);

// Exposure of the camera in stops, which doubles the picture's values each; none where the script gives none.
// Throws Error unless it is in -30..30.
std::optional<double> exposureAt(const Script& script, const warp::ShotTime& time);

struct ShotDirectionalLight {
  Direction3<ObjectSpace, double> towards; // the light; unit
  Rgb irradiance;
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::clamp;
  Vec3<double> irradianceGradient = {0, 0, 0}; // as that of a captured light (rig.h); object space
};
struct ShotPointLight {
  Point3<ObjectSpace, double> position;
  Rgb intensity; // W/sr
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::clamp;
};
struct ShotEnvironment {
  std::shared_ptr<const weights::EnvironmentMap> map; // never null; renderers keep what they prepare, by map
  Rotation<ObjectSpace, EnvironmentSpace> objectFromEnvironment;
  Rgb strength{1, 1, 1}; // radiance scale
  double error = 0.01;   // allowed in the captured lights' weights, as in EnvironmentLightMotion
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::fade;
};
using ShotLight = std::variant<ShotDirectionalLight, ShotPointLight, ShotEnvironment>;

// A plane that shows shadows alone, on the side of its normal. Where a part d of the light is kept away,
// black of alpha d x shadow lies behind the object.
struct ShotGround {
  Point3<ObjectSpace, double> point;
  Normal3<ObjectSpace, double> normal; // unit
  double shadow = 1;                   // strength, 0..1
};

// The content of one frame, for any renderer.
struct Scene {
  const warp::Warp& warp; // of the object; must outlive the scene
  capture::Camera<ObjectSpace> camera;
  std::vector<ShotLight> lights;
  std::optional<ShotGround> ground =
      {}; // renderers of fixed light (Description::isBaked) throw Error for one
};

// One per light of the script; `environments` are those that readEnvironments returns for it. Before and
// after the film, strengths are those of its ends, and so is that of the ground's shadow. Throws Error where
// a track is not finite, a direction zero or a strength negative.
std::vector<ShotLight> lightsAt(const Script& script, const warp::ShotTime& time,
                                std::span<const Environment> environments = {});

// The script's ground, if it has one. Throws Error where a track is not finite, the normal zero or the
// strength outside 0..1.
std::optional<ShotGround> groundAt(const Script& script, const warp::ShotTime& time);

// Blur of a frame.
struct ShotBlur {
  double shutter = 0;                  // open part of a frame's duration, 0..1
  double aperture = 0;                 // diameter of the lens
  std::optional<double> focusDistance; // empty: not given, and neither is a point that the camera looks at

  bool isSharp() const { return shutter == 0 && aperture == 0; }
};

// Blur of the script's camera. The focus is by default at the distance of the point that the camera looks at.
// Throws Error where a track is not finite, shutter_deg is outside 0..360, aperture is negative, or
// focus_distance is not more than 0.
ShotBlur blurAt(const Script& script, const warp::ShotTime& time);

// Same camera or light in object space. Capture and script share one world, so coordinates do not change.
capture::Camera<ObjectSpace> inObjectSpace(const capture::Camera<AcquisitionSpace>& camera);
ShotLight inObjectSpace(const capture::Light& light);

// All warps of the script, chained; the identity if there is none. Throws Error as warp::evaluateAt does.
warp::WarpPointer warpAt(const Script& script, const warp::ShotTime& time);

} // namespace surflect::scene
