#include "render/scene/turntable.h"

#include "surfel/math/median.h"
#include "surfel/math/space.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace surflect::scene {

namespace {

constexpr double kFovDeg = 30, kMargin = 1.15; // the object's sphere fills 1 / kMargin of the height
constexpr int kFrames = 48;

// Mean of the cameras' ups; an axis of the coordinates where one is near.
Vec3<double> upOf(const capture::Capture& rig) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (const capture::View& view : rig.views)
    sum += view.camera.cameraFromWorld.rotation().row(1).transpose();
  if (sum.norm() < 1e-6) return {0, 1, 0};
  const Vec3<double> up = sum.normalized();
  Eigen::Index axis;
  const double along = up.cwiseAbs().maxCoeff(&axis);
  if (along < std::cos(Angle::fromDegrees(20).radians())) return up;
  return std::copysign(1.0, up[axis]) * Vec3<double>::Unit(axis);
}

// Azimuth and elevation of a direction from the middle, as an orbit has them.
struct OrbitAngles {
  double azimuthDeg, elevationDeg;
};

OrbitAngles anglesOf(const Vec3<double>& direction, const Vec3<double>& up) {
  const Vec3<double> d =
      Eigen::Quaterniond::FromTwoVectors(up, Vec3<double>(0, 1, 0)) * direction.normalized();
  return {Angle::fromRadians(std::atan2(d.x(), d.z())).degrees(),
          Angle::fromRadians(std::asin(std::clamp(d.y(), -1.0, 1.0))).degrees()};
}

// Azimuths of a turn: all around, or to and fro within the sector that cameras have seen.
struct Turn {
  double first, last; // degrees
  bool isWhole;
};

Turn turnOf(std::vector<double> azimuths) {
  constexpr double kWidestGap = 120, kLeastSwing = 10;
  std::ranges::sort(azimuths);
  double widest = 0, start = azimuths.front(); // the sector starts where the widest gap ends
  for (size_t i = 0; i < azimuths.size(); ++i) {
    const double next = i + 1 < azimuths.size() ? azimuths[i + 1] : azimuths.front() + 360;
    if (next - azimuths[i] > widest) {
      widest = next - azimuths[i];
      start = next;
    }
  }
  if (widest <= kWidestGap) return {azimuths.front(), azimuths.front() + 360, true};
  const double half = std::max(0.5 * (360 - widest), kLeastSwing), middle = start + 0.5 * (360 - widest);
  return {middle - half, middle + half, false};
}

// Directions of up to three captured lights: the one nearest to the first camera's side from above, then
// those farthest from the chosen ones.
std::vector<Vec3<double>> lampsOf(const TurntableObject& object, const Vec3<double>& middle,
                                  const Vec3<double>& towardsCamera, const Vec3<double>& up) {
  std::vector<Vec3<double>> directions, chosen;
  for (const capture::Light& light : object.rig.lights)
    directions.push_back(
        capture::towardsLight(light, assume<Point3<AcquisitionSpace, double>>(middle)).raw());
  const Vec3<double> key = (towardsCamera.normalized() + 0.7 * up).normalized();
  while (chosen.size() < std::min<size_t>(3, directions.size())) {
    const auto worth = [&](const Vec3<double>& d) {
      if (chosen.empty()) return d.dot(key);
      double nearest = -1;
      for (const Vec3<double>& other : chosen) nearest = std::max(nearest, d.dot(other));
      return -nearest;
    };
    chosen.push_back(*std::ranges::max_element(directions, {}, worth));
  }
  return chosen;
}

std::string list(const Vec3<double>& v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x(), v.y(), v.z());
}

std::string tomlText(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

} // namespace

std::string turntableScript(const TurntableObject& object) {
  Eigen::AlignedBox3d box;
  for (const auto& point : object.points) box.extend(point.raw().template cast<double>());
  const Vec3<double> up = upOf(object.rig), middle = box.center();
  double radius = 0;
  for (const auto& point : object.points)
    radius = std::max(radius, (point.raw().template cast<double>() - middle).norm());
  const double distance =
      kMargin * std::max(radius, 1e-9) / std::sin(0.5 * Angle::fromDegrees(kFovDeg).radians());
  std::vector<double> azimuths, elevations;
  for (const capture::View& view : object.rig.views) {
    const Vec3<double> backwards = view.camera.cameraFromWorld.rotation().row(2).transpose();
    const OrbitAngles angles = anglesOf(backwards, up);
    azimuths.push_back(angles.azimuthDeg);
    elevations.push_back(angles.elevationDeg);
  }
  if (azimuths.empty()) azimuths.push_back(0), elevations.push_back(15);
  const Turn turn = turnOf(azimuths);
  const std::string azimuth =
      turn.isWhole ? fmt::format("[[1, {:.5g}], [{}, {:.5g}]]", turn.first, kFrames + 1, turn.last)
                   : fmt::format("[[1, {0:.5g}, \"smooth\"], [{2}, {1:.5g}, \"smooth\"], [{3}, {0:.5g}]]",
                                 turn.first, turn.last, kFrames / 2 + 1, kFrames + 1);
  std::string text =
      fmt::format(R"(# The camera goes {} the object.
model = {}

[frames]
first = 1
last = {}
fps = 24

[output]
size = [960, 720]
path = "frame.####.exr"
png = true

[camera]
fov_deg = {}
up = {}
[camera.orbit]
center = {}
radius = {:.6g}
azimuth_deg = {}
elevation_deg = {:.4g}
)",
                  turn.isWhole ? "round" : "to and fro before", tomlText(object.model), kFrames, kFovDeg,
                  list(up), list(middle), distance, azimuth, std::clamp(median(elevations), -60.0, 60.0));
  if (object.isBaked || object.rig.lights.empty()) return text;
  const Vec3<double> towardsCamera =
      object.rig.views.empty()
          ? up
          : Vec3<double>(object.rig.views.front().camera.cameraFromWorld.rotation().row(2).transpose());
  text +=
      "\n# Lamps where photographs were lit. Intensity pi on a white surface that faces it reflects white.\n";
  const double intensities[] = {2.2, 0.9, 0.6};
  size_t lamp = 0;
  for (const Vec3<double>& direction : lampsOf(object, middle, towardsCamera, up))
    text += fmt::format("[[light]]\ntype = \"directional\"\ndirection = {}\nintensity = {}\n",
                        list(direction), intensities[lamp++]);
  return text;
}

} // namespace surflect::scene
