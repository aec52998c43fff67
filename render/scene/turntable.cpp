#include "render/scene/turntable.h"

#include "surfel/math/median.h"
#include "surfel/math/space.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace surflect::scene {

namespace {

constexpr double kFovDeg = 30, kMargin = 1.15; // the object's sphere fills 1 / kMargin of the height
constexpr int kFrames = 48;

// Azimuth and elevation of a direction from the middle, as an orbit has them.
struct OrbitAngles {
  double azimuthDeg, elevationDeg;
};

OrbitAngles anglesOf(const Vec3<double>& direction, const Vec3<double>& up) {
  const Vec3<double> d = turnFromY(up).conjugate() * direction.normalized();
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

// Box around an object, the direction that is up, and how high the object is along it.
struct Extent {
  Eigen::AlignedBox3d box;
  Vec3<double> up;
  double height;
  Vec3<double> foot; // below the middle of the box, where the object begins
};

Extent extentOf(const TurntableObject& object) {
  Extent extent{{}, upOf(object.rig), 0, {0, 0, 0}};
  for (const auto& point : object.points) extent.box.extend(point.raw().template cast<double>());
  const Vec3<double> middle = extent.box.center();
  double least = 0, most = 0;
  for (const auto& point : object.points) {
    const double along = extent.up.dot(point.raw().template cast<double>() - middle);
    least = std::min(least, along), most = std::max(most, along);
  }
  extent.height = std::max(most - least, 1e-9);
  extent.foot = middle + least * extent.up;
  return extent;
}

// A direction at right angles to `up`: the axis that is least along it.
Vec3<double> acrossOf(const Vec3<double>& up) {
  Eigen::Index axis;
  up.cwiseAbs().minCoeff(&axis);
  return (Vec3<double>::Unit(axis) - up[axis] * up).normalized();
}

} // namespace

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

Eigen::Quaterniond turnFromY(const Vec3<double>& up) {
  // Eigen's FromTwoVectors takes long to compile, and is off by up to 1e-4 where up is nearly -y.
  const double x = up.x(), y = up.y(), z = up.z();
  const double onePlusY = y > 0 ? 1 + y : (x * x + z * z) / (1 - y); // without cancellation
  const Eigen::Quaterniond turn(onePlusY, z, 0, -x); // times twice the cosine of half the angle
  if (turn.coeffs().isZero(0)) return {0, 0, 0, 1};
  return Eigen::Quaterniond(turn.coeffs().stableNormalized());
}

Vec3<double> towardsOrbit(const Vec3<double>& up, Angle azimuth, Angle elevation) {
  const double a = azimuth.radians(), e = elevation.radians();
  return turnFromY(up) *
         Vec3<double>(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)); // y up
}

TurntableOrbit turntableOrbit(const TurntableObject& object) {
  const auto [box, up, height, foot] = extentOf(object);
  const Vec3<double> middle = box.center();
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
  return {.center = middle,
          .up = up,
          .ballRadius = radius,
          .distance = distance,
          .fovDeg = kFovDeg,
          .elevationDeg = std::clamp(median(elevations), -60.0, 60.0),
          .firstAzimuthDeg = turn.first,
          .lastAzimuthDeg = turn.last,
          .isWhole = turn.isWhole};
}

std::string turntableScript(const TurntableObject& object) {
  const TurntableOrbit orbit = turntableOrbit(object);
  const double first = orbit.firstAzimuthDeg, last = orbit.lastAzimuthDeg;
  const std::string azimuth =
      orbit.isWhole ? fmt::format("[[1, {:.5g}], [{}, {:.5g}]]", first, kFrames + 1, last)
                    : fmt::format("[[1, {0:.5g}, \"smooth\"], [{2}, {1:.5g}, \"smooth\"], [{3}, {0:.5g}]]",
                                  first, last, kFrames / 2 + 1, kFrames + 1);
  std::string text = fmt::format(R"(# The camera goes {} the object.
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
                                 orbit.isWhole ? "round" : "to and fro before", tomlText(object.model),
                                 kFrames, orbit.fovDeg, list(orbit.up), list(orbit.center), orbit.distance,
                                 azimuth, orbit.elevationDeg);
  if (object.isBaked || object.rig.lights.empty()) return text;
  const Vec3<double> towardsCamera =
      object.rig.views.empty()
          ? orbit.up
          : Vec3<double>(object.rig.views.front().camera.cameraFromWorld.rotation().row(2).transpose());
  text +=
      "\n# Lamps where photographs were lit. Intensity pi on a white surface that faces it reflects white.\n";
  const double intensities[] = {2.2, 0.9, 0.6};
  size_t lamp = 0;
  for (const Vec3<double>& direction : lampsOf(object, orbit.center, towardsCamera, orbit.up))
    text += fmt::format("[[light]]\ntype = \"directional\"\ndirection = {}\nintensity = {}\n",
                        list(direction), intensities[lamp++]);
  return text;
}

std::string starterScript(const TurntableObject& object) {
  std::string text = turntableScript(object);
  if (object.isBaked) return text;
  const auto [box, up, height, foot] = extentOf(object);
  const Vec3<double> across = acrossOf(up), head = foot + height * up;
  const std::string axis = list(up), aside = list(across), from = list(foot);
  // Keyframes to a value in the middle of the shot, and back.
  const auto pulse = [&](double from0, double value) {
    return fmt::format("[[1, {0:.4g}], [{2}, {1:.4g}, \"smooth\"], [{3}, {0:.4g}, \"smooth\"]]", from0, value,
                       kFrames / 2 + 1, kFrames + 1);
  };
  const auto block = [&](const std::string& comment, const std::string& lines) {
    text += "# " + comment + '\n';
    for (size_t begin = 0; begin < lines.size();) {
      const size_t end = lines.find('\n', begin);
      text += "#" + lines.substr(begin, end - begin) + '\n';
      begin = end + 1;
    }
    text += '\n';
  };
  text += "\n# Warps bend space, in this order. Take away the \"#\" right before the lines of one to try it; "
          "docs/script.md\n"
          "# explains their keys.\n\n";
  block("Turns the object about its axis, and lifts it.",
        fmt::format("[[warp]]\ntype = \"rigid\"\naxis = {}\ncenter = {}\nangle_deg = {}\ntranslate = {}\n",
                    axis, from, pulse(0, 40), list(0.1 * height * up)));
  block("Stretches it along x, y and z.",
        fmt::format("[[warp]]\ntype = \"scale\"\ncenter = {}\nfactor = [1.2, 1, 0.9]\n", from));
  block("Twists it about its axis.",
        fmt::format("[[warp]]\ntype = \"twist\"\naxis = {}\ncenter = {}\nangle_deg = {}\nlength = {:.4g}\n",
                    axis, from, pulse(0, 90), height));
  block("Bends it over.", fmt::format("[[warp]]\ntype = \"bend\"\naxis = {}\ndirection = {}\ncenter = "
                                      "{}\nangle_deg = {}\nlength = {:.4g}\n",
                                      axis, aside, from, pulse(0, 45), height));
  block("Makes it narrower towards its head.",
        fmt::format("[[warp]]\ntype = \"taper\"\naxis = {}\ncenter = {}\nfactor = {}\nlength = {:.4g}\n",
                    axis, from, pulse(1, 0.6), height));
  block("Sends waves up.", fmt::format("[[warp]]\ntype = \"sine\"\naxis = {}\ndirection = {}\ncenter = "
                                       "{}\namplitude = {:.4g}\nwavelength = "
                                       "{:.4g}\nphase_deg = \"-360*t\"\n",
                                       axis, aside, from, 0.04 * height, 0.5 * height));
  block("Anything by formulas of x, y, z, t, frame and s.",
        fmt::format(
            "[[warp]]\ntype = \"expression\"\nx = \"x + {:.4g}*sin({:.4g}*z + 6*t)\"\ny = \"y\"\nz = \"z\"\n",
            0.03 * height, 6 / height));
  block("A lattice around it, of which one corner moves.",
        fmt::format("[[warp]]\ntype = \"lattice\"\nmin = {}\nmax = {}\ndivisions = [2, 2, 2]\npoint = [{{ at "
                    "= [2, 2, 2], "
                    "move = {} }}]\n",
                    list(box.min()), list(box.max()), list(0.3 * height * up)));
  block("Handles: the head is pulled aside, the foot stays.",
        fmt::format("[[warp]]\ntype = \"handles\"\nhandle = [\n  {{ rest = {}, to = {} }},\n  {{ rest = {}, "
                    "to = {} }},\n]\n",
                    list(head), list(head + 0.2 * height * across), from, from));
  return text;
}

} // namespace surflect::scene
