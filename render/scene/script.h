// The shot script: a TOML file that says which model, camera, lights and warps make the frames of a shot.
//
// Any number is a literal, a list of keyframes [[frame, value], [frame, value, "smooth"], ...] or an
// expression in t, frame and s (warp/track.h).
#pragma once

#include "render/scene/camera_path.h"
#include "render/scene/script_fields.h"
#include "srf/weights/environment_map.h"
#include "srf/weights/fades.h"
#include "surfel/math/rgb.h"
#include "warp/motion.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace surflect::scene {

// The [[warp]] tables of a script.

// Warps in the order of their tables; empty without an entry. Throws Error at the field.
std::vector<warp::WarpMotion> asWarps(const std::optional<Entry>& entry);

struct Frames {
  int first = 1, last = 1; // 0 <= first <= last <= 1000000
  double fps = 24;

  int count() const { return last - first + 1; }
};

// Curve from the light of a frame to that of a screen; both are 1 at white.
enum class Tone {
  none,   // clipped at white
  filmic, // rolls off towards white [Hable 2010]
  ocio    // a view of the OpenColorIO configuration that $OCIO names
};
inline constexpr std::array<std::string_view, 3> toneNames = {"none", "filmic", "ocio"};

// Background behind the object: none, a colour as displayed in 0..1, or a picture (resolved against the
// script's folder).
using Background = std::variant<std::monostate, Rgb, std::filesystem::path>;

// How PNG and video show a frame. The EXR knows nothing of it.
struct Finish {
  Tone tone = Tone::none;
  std::string ocioDisplay, ocioView; // empty: those that the configuration prefers
  Background background;

  friend bool operator==(const Finish&, const Finish&) = default;
};

struct Output {
  int width = 0, height = 0; // 1..16384
  std::string path;          // as written: "frame.####.exr"; see framePath in scene.h
  bool png = false;
  std::string video = {}; // as written: "film.mp4" or "film.mov"; empty: none
  Finish finish = {};
  std::string owner = {};             // of the frames, for their headers; may be empty
  std::vector<std::string> aov = {};  // each one of aovNames, none twice
  std::vector<std::string> maps = {}; // each one of mapNames, none twice
  int samples = 16;                   // pictures that a blurred frame averages; 1..mostSamples
};
inline constexpr int mostSamples = 1024;
inline constexpr std::array<std::string_view, 3> mapNames = {"normal", "height", "albedo"};
inline constexpr std::array<std::string_view, 8> aovNames = {
    "depth", "normal", "position", "rest", "camera_blend", "light_blend", "stretch", "predicted_error"};

// The captured camera of this name.
struct NamedCamera {
  std::string from;
};
struct LookAtCamera {
  warp::Track3 position, lookAt, up;
  warp::Track fovDeg; // vertical
};
// Looks at `center` from `radius` away. With y up, azimuth 0 stands on +z and grows towards +x; another `up`
// turns all of this along the shortest arc, so that z up starts on -y.
struct OrbitCamera {
  warp::Track3 center, up;
  warp::Track radius, azimuthDeg, elevationDeg;
  warp::Track fovDeg; // vertical
};
// Poses and lenses from a file.
struct FileCamera {
  std::shared_ptr<const CameraPath> path; // never null
};
using CameraMotion = std::variant<NamedCamera, LookAtCamera, OrbitCamera, FileCamera>;

// Blur of any camera: by motion while the shutter is open, and by a thin lens.
struct CameraBlur {
  warp::Track shutterDeg;                   // 0..360: a full turn is a frame's duration, centred on the frame
  warp::Track aperture;                     // diameter of the lens
  std::optional<warp::Track> focusDistance; // of the plane in focus, along the viewing axis
};

// A plane that shows shadows alone.
struct GroundMotion {
  warp::Track3 point, normal; // normal: any length; lights below the plane do not count
  warp::Track shadow = 1;     // strength, 0..1
};

// color * intensity is irradiance on a surface that faces the light.
struct DirectionalLightMotion {
  warp::Track3 direction; // towards the light, any length
  warp::Track3 color;
  warp::Track intensity;
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::clamp;
};
// color * intensity is in W/sr.
struct PointLightMotion {
  warp::Track3 position;
  warp::Track3 color;
  warp::Track intensity;
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::clamp;
};
// color * intensity multiplies the picture's radiance. The picture's own up (y) is turned to `up` along the
// shortest arc, as an orbit is, after a turn by rotate_deg about it, counter-clockwise seen from above.
struct EnvironmentLightMotion {
  std::filesystem::path image;                        // resolved against the script's folder
  std::optional<weights::EnvironmentMapping> mapping; // by the picture's shape where not given
  warp::Track3 up;
  warp::Track rotateDeg;
  warp::Track3 color;
  warp::Track intensity;
  double error = 0.01; // of the captured lights' weights, about; 0.0001..1
  weights::LightExtrapolation extrapolation = weights::LightExtrapolation::fade;
};
using LightMotion = std::variant<DirectionalLightMotion, PointLightMotion, EnvironmentLightMotion>;

// A model of a scene of several: its own coordinates are scaled, rotated, then moved.
struct PlacedModel {
  std::filesystem::path model; // resolved against the script's folder
  double scale = 1;            // 1e-6..1e6
  Mat3<double> rotation = Mat3<double>::Identity();
  Vec3<double> position = {0, 0, 0}; // of the model's origin
};

// Origin that positions in a script are relative to: the model's, or that of the source before import moved
// the origin (Capture::origin).
enum class Coordinates { model, original };

struct Script {
  std::filesystem::path path;
  uint64_t hash = 0;                // contentHash of the text, and of the files of its camera and warps
  std::filesystem::path model;      // resolved against the script's folder; empty: not given
  std::vector<PlacedModel> objects; // a scene of several models instead
  Coordinates coordinates = Coordinates::model;
  std::optional<Frames> frames;
  std::optional<Output> output;
  std::optional<CameraMotion> camera;
  std::optional<warp::Track> exposure; // of the camera, in stops; see exposureAt in scene.h
  CameraBlur blur;
  std::optional<GroundMotion> ground;
  std::vector<LightMotion> lights;
  std::vector<warp::WarpMotion> warps; // in the order in which they act
};

// Head of a shot: all that is needed before the model is opened.
struct ScriptHead {
  std::filesystem::path model; // as in Script
  std::vector<PlacedModel> objects;
  Coordinates coordinates = Coordinates::model;
  Frames frames;
  Output output;
};

// Reads the head alone: no lights, no camera, and no warps with their files. `model`, if it is not empty,
// replaces the script's. Throws Error as readScript does, and where requireShot would.
ScriptHead readScriptHead(const std::filesystem::path& path, const std::filesystem::path& model = {});

// Throw Error naming file, field and line. A misspelt key is answered with the nearest known one. `origin` is
// Capture::origin of the model's rig; it is subtracted from the positions of a script in original
// coordinates. A missing centre is 0, or an Error in such a script unless `origin` is 0.
Script readScript(const std::filesystem::path& path, const Vec3<double>& origin = Vec3<double>::Zero());
Script parseScript(std::string_view text, const std::filesystem::path& path,
                   const Vec3<double>& origin = Vec3<double>::Zero());

// Throws Error unless a model or objects, frames, output and camera are given (a script for `evaluate` may
// have warps alone).
void requireShot(const Script& script);

} // namespace surflect::scene
