#include "render/stage/rig_section.h"

#include "render/stage/material/shading.h"
#include "render/stage/rig.h"
#include "render/stage/stage_fields.h"

#include <fmt/format.h>

#include <cmath>

namespace surflect {

namespace {

constexpr int kMostSide = 16384, kMostViews = 100'000, kMostLights = 4096;
constexpr double kMostValues = 0x1p29; // of one view: floats of all its lights, which are in memory twice

struct CameraKind {
  Lens lens;
  double distance;
};

CameraKind asCameraKind(const Entry& entry) {
  const Section s(entry, {"model", "size", "distance", "fov_deg", "height"});
  const Entry size = s.require("size");
  const auto sides = asArray(size, "[width, height]");
  if (sides.size() != 2) throw mismatch(size, "[width, height]");
  Lens lens;
  lens.width = asInteger(sides[0], 1, kMostSide);
  lens.height = asInteger(sides[1], 1, kMostSide);
  lens.centerX = lens.width / 2.0;
  lens.centerY = lens.height / 2.0;
  const Entry model = s.require("model");
  if (const std::string name = asText(model); name == "orthographic")
    lens.model = Lens::Model::orthographic;
  else if (name != "pinhole")
    throw mismatch(model, "pinhole or orthographic");
  const bool isPinhole = lens.model == Lens::Model::pinhole;
  if (const auto other = s.find(isPinhole ? "height" : "fov_deg"))
    throw mismatch(*other, isPinhole ? "fov_deg for a pinhole" : "height for an orthographic camera");
  lens.focalX = lens.focalY =
      isPinhole ? lens.centerY /
                      std::tan(Angle::fromDegrees(numberIn(s.require("fov_deg"), 0.001, 179)).radians() / 2)
                : lens.height / positive(s.require("height"));
  return {lens, positive(s.require("distance"))};
}

// Directions for training, and how many of `all` they are: those of the test follow, between the others.
struct Placement {
  std::vector<RigDirection> all;
  size_t training;
};

// That of the test starts at another azimuth, so that it does not repeat the training's.
Placement withTest(std::vector<RigDirection> training, int test, double lowest, double highest) {
  Placement placement{std::move(training), 0};
  placement.training = placement.all.size();
  for (const auto& direction : spiral(test, lowest, highest, Angle::fromDegrees(50)))
    placement.all.push_back(direction);
  return placement;
}

Placement asViews(const Entry& entry) {
  const Section s(entry, {"turntable", "elevations_deg", "count", "test"});
  const int test = integerOr(s, "test", 0, kMostViews, 0);
  if (const auto count = s.find("count")) {
    for (const char* key : {"turntable", "elevations_deg"})
      if (const auto other = s.find(key)) throw mismatch(*other, "no such key beside count");
    return withTest(spiral(asInteger(*count, 1, kMostViews), -1, 1, Angle()), test, -1, 1);
  }
  const int steps = asInteger(s.require("turntable"), 1, kMostViews);
  const Entry list = s.require("elevations_deg");
  std::vector<Angle> elevations;
  double lowest = 1, highest = -1;
  for (const Entry& element : asArray(list, "a list of angles")) {
    elevations.push_back(Angle::fromDegrees(numberIn(element, -90, 90)));
    lowest = std::min(lowest, std::sin(elevations.back().radians()));
    highest = std::max(highest, std::sin(elevations.back().radians()));
  }
  if (elevations.empty() || elevations.size() > static_cast<size_t>(kMostViews / steps))
    throw mismatch(list, fmt::format("one elevation or more, and at most {} views", kMostViews));
  return withTest(turntable(steps, elevations), test, lowest, highest);
}

void addLights(const Entry& entry, const Point3<AcquisitionSpace, double>& center, StageRig& rig) {
  const Section s(entry, {"count", "test", "irradiance", "distance", "radius_deg"});
  const Placement placement = withTest(spiral(asInteger(s.require("count"), 1, kMostLights), -1, 1, Angle()),
                                       integerOr(s, "test", 0, kMostLights, 0), -1, 1);
  rig.trainingLights = placement.training;
  const Rgb irradiance = asColor(s.require("irradiance"), 1e-3, 1e6);
  const auto distance = s.find("distance"), radius = s.find("radius_deg");
  if (distance && radius) throw mismatch(*radius, "no such key beside distance: point lights have no extent");
  if (radius) rig.lightRadius = Angle::fromDegrees(numberIn(*radius, 0.001, 89));
  for (const RigDirection& direction : placement.all) {
    Light light;
    light.name = light.identity = fmt::format("L{:02}", rig.lights.size());
    if (distance) {
      const double d = positive(*distance);
      light.kind = PointLight{center + d * direction, scaled(d * d, irradiance)};
    } else {
      light.kind = DirectionalLight{direction, irradiance};
    }
    rig.lights.push_back(std::move(light));
  }
}

} // namespace

StageRig asRig(const Section& stage) {
  StageRig rig;
  const auto center = pointOr0(stage, "center");
  const CameraKind camera = asCameraKind(stage.require("camera"));
  const Placement views = asViews(stage.require("views"));
  rig.trainingViews = views.training;
  for (const RigDirection& direction : views.all)
    rig.views.push_back({fmt::format("C{:03}", rig.views.size()),
                         cameraAbout(center, direction, camera.distance, camera.lens)});
  addLights(stage.require("lights"), center, rig);
  const double values = 3.0 * camera.lens.width * camera.lens.height * static_cast<double>(rig.lights.size());
  if (values > kMostValues)
    throw Error::mismatch(fmt::format("at most {:.3g} pixels under all lights", kMostValues / 3),
                          fmt::format("{:.3g}", values / 3))
        .at("camera.size");
  return rig;
}

} // namespace surflect
