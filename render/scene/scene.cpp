#include "render/scene/scene.h"

#include "render/scene/turntable.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"
#include "surfel/base/time.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::scene {

namespace {

Environment readOne(const EnvironmentLightMotion& light, const Progress& progress) {
  const Stopwatch watch;
  const auto map = std::make_shared<const weights::EnvironmentMap>(
      weights::readEnvironment(light.image, light.mapping, progress));
  static_assert(sizeof(weights::EnvironmentLight) == 7 * sizeof(float)); // no padding to hash
  return {light.image, map, contentHash(std::as_bytes(std::span(map->lights))), watch.seconds()};
}

} // namespace

std::vector<Environment> Environments::read(const Script& script, const Progress& progress) {
  std::vector<Environment> environments;
  for (size_t i = 0; i < script.lights.size(); ++i) {
    const auto* light = std::get_if<EnvironmentLightMotion>(&script.lights[i]);
    if (!light) continue;
    const auto [kept, isNew] = kept_.try_emplace({light->image, light->mapping});
    if (isNew) {
      try {
        progress("environment", static_cast<double>(i) / static_cast<double>(script.lights.size()));
        kept->second = readOne(*light, progress);
      } catch (...) {
        kept_.erase(kept);
        throw;
      }
    }
    environments.push_back(kept->second);
  }
  return environments;
}

namespace {

// Rows right, up, back: the camera at `position` looks at `target`.
Rigid<CameraSpace, ObjectSpace> lookAt(const Vec3<double>& position, const Vec3<double>& target,
                                       const Vec3<double>& up) {
  const Vec3<double> back = (position - target).stableNormalized();
  if (!(back.squaredNorm() > 0.5))
    throw Error::mismatch("some distance", "the camera at the point it looks at");
  const Vec3<double> across = up.cross(back);
  if (!(across.norm() > 1e-9)) throw Error::mismatch("another direction", "the viewing direction").at("up");
  const Vec3<double> right = across.normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  return {rotation, -(rotation * position)};
}

capture::Lens lensOf(const Output& output, const warp::Track& fovDeg, const warp::ShotTime& time) {
  const double degrees = warp::finiteAt(fovDeg, time, "fov_deg");
  if (!(degrees > 1e-3 && degrees < 179.999))
    throw Error::mismatch("more than 0.001 and less than 179.999", numberText(degrees)).at("fov_deg");
  capture::Lens lens;
  lens.width = output.width;
  lens.height = output.height;
  lens.centerX = output.width / 2.0;
  lens.centerY = output.height / 2.0;
  lens.focalX = lens.focalY = lens.centerY / std::tan(Angle::fromDegrees(degrees).radians() / 2);
  return lens;
}

Rigid<CameraSpace, ObjectSpace> placed(const LookAtCamera& camera, const warp::ShotTime& time) {
  return lookAt(warp::finiteAt(camera.position, time, "position"),
                warp::finiteAt(camera.lookAt, time, "look_at"), warp::unitAt(camera.up, time, "up"));
}

Rigid<CameraSpace, ObjectSpace> placed(const OrbitCamera& camera, const warp::ShotTime& time) {
  const Vec3<double> center = warp::finiteAt(camera.center, time, "orbit.center"),
                     up = warp::unitAt(camera.up, time, "up");
  const double radius = warp::finiteAt(camera.radius, time, "orbit.radius");
  const Angle azimuth = Angle::fromDegrees(warp::finiteAt(camera.azimuthDeg, time, "orbit.azimuth_deg"));
  const Angle elevation =
      Angle::fromDegrees(warp::finiteAt(camera.elevationDeg, time, "orbit.elevation_deg"));
  if (!(radius > 0)) throw Error::mismatch("more than 0", numberText(radius)).at("orbit.radius");
  return lookAt(center + radius * towardsOrbit(up, azimuth, elevation), center, up);
}

Rgb strengthAt(const warp::Track3& color, const warp::Track& intensity, const warp::ShotTime& time) {
  const Vec3<double> rgb =
      warp::finiteAt(color, time, "color") * warp::finiteAt(intensity, time, "intensity");
  if (!(rgb.minCoeff() >= 0 && rgb.maxCoeff() <= std::numeric_limits<float>::max()))
    throw Error::mismatch("0 to 3.4e38",
                          "color times intensity " +
                              numberText(rgb.minCoeff() < 0 ? rgb.minCoeff() : rgb.maxCoeff()) +
                              " at frame " + numberText(time.frame))
        .at("intensity");
  return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
}

// Place and turn of a light are those at `time`, its strength that at `within` the film.
ShotLight lit(const DirectionalLightMotion& light, const warp::ShotTime& time, const warp::ShotTime& within) {
  return ShotDirectionalLight{
      assume<Direction3<ObjectSpace, double>>(warp::unitAt(light.direction, time, "direction")),
      strengthAt(light.color, light.intensity, within), light.extrapolation};
}

ShotLight lit(const PointLightMotion& light, const warp::ShotTime& time, const warp::ShotTime& within) {
  return ShotPointLight{assume<Point3<ObjectSpace, double>>(warp::finiteAt(light.position, time, "position")),
                        strengthAt(light.color, light.intensity, within), light.extrapolation};
}

ShotLight lit(const EnvironmentLightMotion& light, const warp::ShotTime& time, const warp::ShotTime& within,
              const Environment& environment) {
  const Vec3<double> up = warp::unitAt(light.up, time, "up");
  const double turn = Angle::fromDegrees(warp::finiteAt(light.rotateDeg, time, "rotate_deg")).radians();
  const Mat3<double> objectFromEnvironment =
      (turnFromY(up) * Eigen::AngleAxisd(turn, Vec3<double>::UnitY())).toRotationMatrix();
  return ShotEnvironment{environment.map, Rotation<ObjectSpace, EnvironmentSpace>(objectFromEnvironment),
                         strengthAt(light.color, light.intensity, within), light.error, light.extrapolation};
}

// make(element) for each, errors told with the element's place in the script.
template <class Result, class Element, class Make>
std::vector<Result> each(const Script& script, const std::vector<Element>& elements, const std::string& name,
                         Make make) {
  std::vector<Result> results;
  for (size_t i = 0; i < elements.size(); ++i) {
    try {
      results.push_back(make(elements[i]));
    } catch (Error& error) {
      throw std::move(error).at(name + '[' + std::to_string(i) + ']').in(script.path);
    }
  }
  return results;
}

} // namespace

warp::ShotTime shotTime(const Script& script, double frame) {
  if (!script.frames) return {0, frame, 0};
  const Frames& frames = *script.frames;
  const double elapsed = frame - frames.first;
  return {elapsed / frames.fps, frame, elapsed / std::max(1, frames.last - frames.first)};
}

warp::ShotTime withinFilm(const Script& script, const warp::ShotTime& time) {
  if (!script.frames) return time;
  return shotTime(script, std::clamp<double>(time.frame, script.frames->first, script.frames->last));
}

std::filesystem::path framePath(const Output& output, const std::filesystem::path& folder, int frame) {
  const size_t begin = output.path.find('#'), length = output.path.rfind('#') - begin + 1;
  std::string digits = std::to_string(frame);
  if (digits.size() < length) digits.insert(0, length - digits.size(), '0');
  return folder / std::string(output.path).replace(begin, length, digits);
}

capture::Lens fittedLens(const capture::Lens& lens, const Script& script, std::string_view owner) {
  const Output& output = *script.output;
  if (std::abs(output.width * lens.height - output.height * lens.width) > std::max(output.width, lens.width))
    throw Error::mismatch("the shape of " + std::string(owner) + ", " + sizeText(lens.width, lens.height),
                          sizeText(output.width, output.height))
        .at("output.size")
        .in(script.path);
  return capture::resized(lens, output.width, output.height);
}

capture::Camera<ObjectSpace> cameraAt(const Script& script, const warp::ShotTime& time) {
  assert(script.camera && script.output && !std::holds_alternative<NamedCamera>(*script.camera));
  if (const auto* file = std::get_if<FileCamera>(&*script.camera)) {
    capture::Camera<ObjectSpace> camera = file->path->at(time.frame);
    camera.lens = fittedLens(camera.lens, script, "the camera file's pictures");
    return camera;
  }
  try {
    if (const auto* orbit = std::get_if<OrbitCamera>(&*script.camera))
      return {lensOf(*script.output, orbit->fovDeg, time), placed(*orbit, time)};
    const LookAtCamera& camera = std::get<LookAtCamera>(*script.camera);
    return {lensOf(*script.output, camera.fovDeg, time), placed(camera, time)};
  } catch (Error& error) {
    throw std::move(error).at("camera").in(script.path);
  }
}

std::optional<double> exposureAt(const Script& script, const warp::ShotTime& time) {
  if (!script.exposure) return std::nullopt;
  try {
    const double stops = warp::finiteAt(*script.exposure, time, "exposure");
    if (std::abs(stops) > 30) throw Error::mismatch("stops in -30..30", numberText(stops)).at("exposure");
    return stops;
  } catch (Error& error) {
    throw std::move(error).at("camera").in(script.path);
  }
}

std::vector<ShotLight> lightsAt(const Script& script, const warp::ShotTime& time,
                                std::span<const Environment> environments) {
  size_t used = 0;
  const warp::ShotTime within = withinFilm(script, time);
  return each<ShotLight>(script, script.lights, "light", [&](const LightMotion& light) {
    if (const auto* directional = std::get_if<DirectionalLightMotion>(&light))
      return lit(*directional, time, within);
    if (const auto* point = std::get_if<PointLightMotion>(&light)) return lit(*point, time, within);
    assert(used < environments.size());
    return lit(std::get<EnvironmentLightMotion>(light), time, within, environments[used++]);
  });
}

std::optional<ShotGround> groundAt(const Script& script, const warp::ShotTime& time) {
  if (!script.ground) return std::nullopt;
  try {
    const GroundMotion& ground = *script.ground;
    const double shadow = warp::finiteAt(ground.shadow, withinFilm(script, time), "shadow");
    if (!(shadow >= 0 && shadow <= 1)) throw Error::mismatch("0 to 1", numberText(shadow)).at("shadow");
    return ShotGround{assume<Point3<ObjectSpace, double>>(warp::finiteAt(ground.point, time, "point")),
                      assume<Normal3<ObjectSpace, double>>(warp::unitAt(ground.normal, time, "normal")),
                      shadow};
  } catch (Error& error) {
    throw std::move(error).at("ground").in(script.path);
  }
}

namespace {

// Distance from the camera to the point that it looks at.
std::optional<double> lookDistance(const CameraMotion& camera, const warp::ShotTime& time) {
  if (const auto* orbit = std::get_if<OrbitCamera>(&camera))
    return warp::finiteAt(orbit->radius, time, "orbit.radius");
  if (const auto* posed = std::get_if<LookAtCamera>(&camera))
    return (warp::finiteAt(posed->position, time, "position") -
            warp::finiteAt(posed->lookAt, time, "look_at"))
        .stableNorm();
  return std::nullopt;
}

} // namespace

ShotBlur blurAt(const Script& script, const warp::ShotTime& time) {
  try {
    const CameraBlur& motion = script.blur;
    const double degrees = warp::finiteAt(motion.shutterDeg, time, "shutter_deg");
    if (!(degrees >= 0 && degrees <= 360))
      throw Error::mismatch("0 to 360", numberText(degrees)).at("shutter_deg");
    ShotBlur blur{degrees / 360, warp::finiteAt(motion.aperture, time, "aperture"), {}};
    if (!(blur.aperture >= 0)) throw Error::mismatch("0 or more", numberText(blur.aperture)).at("aperture");
    if (blur.aperture == 0) return blur;
    if (!motion.focusDistance) {
      blur.focusDistance = lookDistance(*script.camera, time);
      return blur;
    }
    blur.focusDistance = warp::finiteAt(*motion.focusDistance, time, "focus_distance");
    if (!(*blur.focusDistance > 0))
      throw Error::mismatch("more than 0", numberText(*blur.focusDistance)).at("focus_distance");
    return blur;
  } catch (Error& error) {
    throw std::move(error).at("camera").in(script.path);
  }
}

warp::WarpPointer warpAt(const Script& script, const warp::ShotTime& time) {
  return warp::chainWarp(
      each<warp::WarpPointer>(script, script.warps, "warp", [&](const warp::WarpMotion& motion) {
        return warp::evaluateAt(motion, time);
      }));
}

capture::Camera<ObjectSpace> inObjectSpace(const capture::Camera<AcquisitionSpace>& camera) {
  return {camera.lens, {camera.cameraFromWorld.rotation(), camera.cameraFromWorld.translation()}};
}

ShotLight inObjectSpace(const capture::Light& light) {
  if (const auto* directional = std::get_if<capture::DirectionalLight>(&light.kind))
    return ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(directional->towards.raw()),
                                directional->irradiance, weights::LightExtrapolation::clamp,
                                directional->irradianceGradient};
  const auto& point = std::get<capture::PointLight>(light.kind);
  return ShotPointLight{assume<Point3<ObjectSpace, double>>(point.position.raw()), point.intensity};
}

} // namespace surflect::scene
