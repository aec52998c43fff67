// The script at one time: where the camera stands, which lights shine and how space is warped.
#pragma once

#include "render/scene/environment.h"
#include "render/scene/script.h"
#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "surfel/math/rgb.h"

#include <filesystem>
#include <variant>
#include <vector>

namespace surflect::scene {

// t and s are 0 where the script has no [frames].
warp::ShotTime shotTime(const Script& script, double frame);

// folder / output.path with its #### replaced by the frame number, padded with zeros.
std::filesystem::path framePath(const Output& output, const std::filesystem::path& folder, int frame);

// Of a LookAtCamera or OrbitCamera, with output's size: the script has both. Throws Error where a track is
// not finite, the viewing direction is zero or along `up`, or fov_deg is outside 0.001..179.999.
capture::Camera<ObjectSpace> cameraAt(const Script& script, const warp::ShotTime& time);

struct ShotDirectionalLight {
  Direction3<ObjectSpace, double> towards; // the light; unit
  Rgb irradiance;
  ulr::LightExtrapolation extrapolation = ulr::LightExtrapolation::clamp;
  Vec3<double> irradianceGradient = {0, 0, 0}; // as that of a captured light (rig.h); object space
};
struct ShotPointLight {
  Point3<ObjectSpace, double> position;
  Rgb intensity; // W/sr
  ulr::LightExtrapolation extrapolation = ulr::LightExtrapolation::clamp;
};
struct ShotEnvironment {
  const PreparedEnvironment* environment = nullptr; // never null
  Rotation<ObjectSpace, EnvironmentSpace> objectFromEnvironment;
  Rgb strength{1, 1, 1}; // radiance scale
};
using ShotLight = std::variant<ShotDirectionalLight, ShotPointLight, ShotEnvironment>;

// One per light of the script, whose environments have been prepared; they are pointed to. Throws Error where
// a track is not finite, a direction zero or a strength negative.
std::vector<ShotLight> lightsAt(const Script& script, const warp::ShotTime& time,
                                std::span<const PreparedEnvironment> environments = {});

// Capture and script share one world: what stood there in acquisition stands there in the shot.
capture::Camera<ObjectSpace> inObjectSpace(const capture::Camera<AcquisitionSpace>& camera);
ShotLight inObjectSpace(const capture::Light& light);

// All warps as one; the identity when there is none. Throws Error as freeze() does.
warp::WarpPointer warpAt(const Script& script, const warp::ShotTime& time);

} // namespace surflect::scene
