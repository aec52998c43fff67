#include "render/stage/rig.h"

#include "render/stage/material/shading.h"
#include "render/stage/stage_plan.h"
#include "srf/capture/rig.h"
#include "surfel/math/sphere_sampling.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

namespace surflect::stage {

namespace {

RigDirection at(double z, double azimuth) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return normalized(RigDirection(r * std::cos(azimuth), r * std::sin(azimuth), z));
}

} // namespace

RigDirection direction(Angle azimuth, Angle elevation) {
  return at(std::sin(elevation.radians()), azimuth.radians());
}

std::vector<RigDirection> turntable(int steps, std::span<const Angle> elevations) {
  std::vector<RigDirection> directions;
  for (const Angle elevation : elevations)
    for (int step = 0; step < steps; ++step)
      directions.push_back(at(std::sin(elevation.radians()), 2 * std::numbers::pi * step / steps));
  return directions;
}

std::vector<RigDirection> spiral(int count, double lowest, double highest, Angle start) {
  std::vector<RigDirection> directions;
  for (const Vec3<double>& d : fibonacciSphere(static_cast<size_t>(count), lowest, highest, start))
    directions.push_back(normalized(RigDirection(d.x(), d.y(), d.z())));
  return directions;
}

capture::Camera<AcquisitionSpace> cameraAbout(const Point3<AcquisitionSpace, double>& center,
                                              const RigDirection& direction, double distance,
                                              const capture::Lens& lens) {
  const Vec3<double> back = direction.raw();
  const bool isUpright = std::abs(back.z()) > 1 - 1e-9;
  const Vec3<double> up = isUpright ? Vec3<double>::UnitY() : Vec3<double>::UnitZ();
  const Vec3<double> right = up.cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  return {lens, {rotation, -(rotation * (center.raw() + distance * back))}};
}

namespace {

constexpr int kMostSide = 16384, kMostViews = 100'000, kMostLights = 4096;
constexpr size_t kMostFrames = 4'000'000;
constexpr double kMostValues = 0x1p29; // floats of one view under all lights, held in memory twice

using Point = Point3<AcquisitionSpace, double>;

// Lens from [camera].
capture::Lens asLens(const scene::Section& s) {
  const scene::Entry size = s.require("size");
  const auto sides = scene::asArray(size, "[width, height]");
  if (sides.size() != 2) throw scene::mismatch(size, "[width, height]");
  capture::Lens lens;
  lens.width = scene::asInteger(sides[0], 1, kMostSide);
  lens.height = scene::asInteger(sides[1], 1, kMostSide);
  lens.centerX = lens.width / 2.0;
  lens.centerY = lens.height / 2.0;
  const scene::Entry model = s.require("model");
  if (const std::string name = scene::asText(model); name == "orthographic")
    lens.model = capture::Lens::Model::orthographic;
  else if (name != "pinhole")
    throw scene::noneOf(model, {"pinhole", "orthographic"});
  const bool isPinhole = lens.model == capture::Lens::Model::pinhole;
  if (const auto other = s.find(isPinhole ? "height" : "fov_deg"))
    throw scene::mismatch(*other, isPinhole ? "fov_deg for a pinhole" : "height for an orthographic camera");
  lens.focalX = lens.focalY =
      isPinhole ? lens.centerY /
                      std::tan(Angle::fromDegrees(numberIn(s.require("fov_deg"), 0.001, 179)).radians() / 2)
                : lens.height / positive(s.require("height"));
  return lens;
}

// Position relative to the centre; without a distance, the section's common one applies.
struct Place {
  RigDirection towards;
  std::optional<double> distance = std::nullopt;
};

// Training positions, then test positions.
struct Placement {
  std::vector<Place> all;
  size_t training = 0;
};

void checkCount(const scene::Entry& entry, size_t count, int most) {
  if (count < 1 || count > static_cast<size_t>(most))
    throw scene::mismatch(entry, fmt::format("1 to {} of them", most));
}

// Directions spread evenly over the part of the sphere between two heights.
std::vector<Place> even(int count, double lowest, double highest, Angle start) {
  std::vector<Place> places;
  for (const auto& direction : spiral(count, lowest, highest, start)) places.push_back({direction});
  return places;
}

// Adds test positions that start at another azimuth, so that they do not repeat the training's.
Placement withTest(std::vector<Place> training, int test, double lowest, double highest) {
  Placement placement{std::move(training), 0};
  placement.training = placement.all.size();
  for (const Place& place : even(test, lowest, highest, Angle::fromDegrees(50)))
    placement.all.push_back(place);
  return placement;
}

RigDirection asRigDirection(const scene::Entry& entry) {
  const Vec3<double> v = asVector(entry);
  if (!(v.norm() > 1e-12)) throw scene::mismatch(entry, "a direction, not 0");
  return assume<RigDirection>(v.stableNormalized());
}

// [azimuth, elevation]
RigDirection asAngles(const scene::Entry& entry) {
  const auto angles = scene::asArray(entry, "[azimuth, elevation]");
  if (angles.size() != 2) throw scene::mismatch(entry, "[azimuth, elevation]");
  return direction(Angle::fromDegrees(numberIn(angles[0], -360, 360)),
                   Angle::fromDegrees(numberIn(angles[1], -90, 90)));
}

Place asPlace(const scene::Entry& entry, std::string_view key, const Point& center) {
  if (key == "directions") return {asRigDirection(entry)};
  if (key == "angles_deg") return {asAngles(entry)};
  const auto away = assume<Point>(asVector(entry)) - center;
  if (!(length(away) >= 1e-9)) throw scene::mismatch(entry, "a position beside the centre");
  return {normalized(away), length(away)};
}

constexpr std::array<std::string_view, 3> kLists = {"directions", "positions", "angles_deg"};

// The one key of `keys` that the section has; throws Error for none or two.
std::string_view chosenOf(const scene::Section& s, const scene::Keys& keys) {
  std::string_view chosen;
  for (const std::string_view key : keys) {
    const auto entry = s.find(key);
    if (!entry) continue;
    if (!chosen.empty()) throw scene::mismatch(*entry, fmt::format("no such key beside {}", chosen));
    chosen = key;
  }
  if (chosen.empty()) s.require(keys.front());
  return chosen;
}

// Positions listed in the section, and its test list of the same kind.
Placement asListed(const scene::Section& s, std::string_view key, const Point& center, int most) {
  Placement placement;
  const auto add = [&](const scene::Entry& list) {
    const auto elements = scene::asArray(list, "a list of such");
    checkCount(list, placement.all.size() + elements.size(), most);
    for (const scene::Entry& element : elements) placement.all.push_back(asPlace(element, key, center));
  };
  add(s.require(key));
  placement.training = placement.all.size();
  if (const auto test = s.find("test")) add(*test);
  return placement;
}

Placement asTurntable(const scene::Section& s, int test) {
  const int steps = scene::asInteger(s.require("turntable"), 1, kMostViews);
  const scene::Entry list = s.require("elevations_deg");
  std::vector<Angle> elevations;
  double lowest = 1, highest = -1;
  for (const scene::Entry& element : scene::asArray(list, "a list of angles")) {
    elevations.push_back(Angle::fromDegrees(numberIn(element, -90, 90)));
    lowest = std::min(lowest, std::sin(elevations.back().radians()));
    highest = std::max(highest, std::sin(elevations.back().radians()));
  }
  if (elevations.empty() || elevations.size() > static_cast<size_t>(kMostViews / steps))
    throw scene::mismatch(list, fmt::format("one elevation or more, and at most {} views", kMostViews));
  std::vector<Place> places;
  for (const auto& direction : turntable(steps, elevations)) places.push_back({direction});
  return withTest(std::move(places), test, lowest, highest);
}

// Positions of cameras or lights, unless another capture gives them.
Placement asPlacement(const scene::Section& s, std::string_view key, const Point& center, int most) {
  if (std::ranges::count(kLists, key)) return asListed(s, key, center, most);
  const int test = integerOr(s, "test", 0, most, 0);
  if (key == "turntable") return asTurntable(s, test);
  return withTest(even(scene::asInteger(s.require("count"), 1, most), -1, 1, Angle()), test, -1, 1);
}

double distanceOf(const Place& place, const std::optional<scene::Entry>& ofAll,
                  const scene::Section& section) {
  if (place.distance) {
    if (ofAll) throw scene::mismatch(*ofAll, "no such key beside positions");
    return *place.distance;
  }
  return positive(ofAll ? *ofAll : section.require("distance"));
}

// Rig of another capture; its pictures are not used.
capture::Capture captureAt(const scene::Entry& entry, StageRig& rig) {
  std::filesystem::path path = scene::asPath(entry);
  std::error_code unreadable; // reported when reading
  if (std::filesystem::is_directory(path, unreadable)) path /= "transforms.json";
  if (std::ranges::find(rig.files, path) == rig.files.end()) rig.files.push_back(path);
  return scene::atFile(entry, [&] { return capture::readCapture(path, capture::PathRule::unmade); });
}

// Returns whether a name is usable as the name of a file and of a layer.
bool isPlain(std::string_view name) {
  const auto isAllowed = [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; };
  return !name.empty() && name.size() < 64 && std::ranges::all_of(name, isAllowed);
}

// Items of a capture, those of training frames first, with their number. If names are not plain or not
// unique, all are numbered.
template <class Item, class NameOf, class Number>
size_t addFrom(const scene::Entry& entry, const std::vector<Item>& items, const std::set<size_t>& training,
               int most, std::vector<Item>& rig, NameOf nameOf, Number number) {
  checkCount(entry, items.size(), most);
  if (training.empty()) throw scene::mismatch(entry, "a capture with training frames");
  for (const bool isTraining : {true, false})
    for (size_t i = 0; i < items.size(); ++i)
      if (training.contains(i) == isTraining) rig.push_back(items[i]);
  std::set<std::string> names;
  for (const Item& item : rig)
    if (isPlain(nameOf(item))) names.insert(nameOf(item));
  if (names.size() < rig.size())
    for (size_t i = 0; i < rig.size(); ++i) number(rig[i], i);
  return training.size();
}

std::string cameraName(size_t number) { return fmt::format("C{:03}", number); }
std::string lightName(size_t number) { return fmt::format("L{:02}", number); }

std::set<size_t> trainingViews(const capture::Capture& capture) {
  std::set<size_t> used;
  for (const capture::Frame& frame : capture.frames)
    if (frame.split == capture::Split::train) used.insert(frame.view);
  return used;
}

std::set<size_t> trainingLights(const capture::Capture& capture) {
  std::set<size_t> used;
  for (const capture::Frame& frame : capture.frames)
    if (frame.split == capture::Split::train && frame.light) used.insert(*frame.light);
  return used;
}

void addViews(const scene::Section& stage, const Point& center, StageRig& rig) {
  const scene::Section s(stage.require("views"), {"turntable", "elevations_deg", "count", "directions",
                                                  "positions", "angles_deg", "from", "test"});
  const std::string_view key =
      chosenOf(s, {"count", "turntable", "directions", "positions", "angles_deg", "from"});
  if (const auto other = s.find("elevations_deg"); other && key != "turntable")
    throw scene::mismatch(*other, fmt::format("no such key beside {}", key));
  if (key == "from") {
    const scene::Entry from = s.require("from");
    if (const auto other = s.find("test")) throw scene::mismatch(*other, "no such key beside from");
    if (const auto camera = stage.find("camera"))
      throw scene::mismatch(*camera, "no such table beside views.from");
    const capture::Capture capture = captureAt(from, rig);
    rig.trainingViews = addFrom(
        from, capture.views, trainingViews(capture), kMostViews, rig.views,
        [](const capture::View& view) { return view.identity; },
        [](capture::View& view, size_t i) { view.identity = cameraName(i); });
    return;
  }
  const scene::Section camera(stage.require("camera"), {"model", "size", "distance", "fov_deg", "height"});
  const capture::Lens lens = asLens(camera);
  const auto distance = camera.find("distance");
  const Placement placement = asPlacement(s, key, center, kMostViews);
  rig.trainingViews = placement.training;
  for (const Place& place : placement.all)
    rig.views.push_back({cameraName(rig.views.size()),
                         cameraAbout(center, place.towards, distanceOf(place, distance, camera), lens)});
}

constexpr std::string_view kNoExtent = "no such key for point lights, which have no extent";

void addLightsFrom(const scene::Section& s, StageRig& rig) {
  const scene::Entry from = s.require("from");
  for (const char* key : {"test", "irradiance", "distance"})
    if (const auto other = s.find(key)) throw scene::mismatch(*other, "no such key beside from");
  const capture::Capture capture = captureAt(from, rig);
  if (capture.lights.empty()) throw scene::mismatch(from, "a capture with lights");
  const auto isPoint = [](const capture::Light& light) {
    return std::holds_alternative<capture::PointLight>(light.kind);
  };
  if (const auto radius = s.find("radius_deg"); radius && std::ranges::all_of(capture.lights, isPoint))
    throw scene::mismatch(*radius, kNoExtent);
  rig.trainingLights = addFrom(
      from, capture.lights, trainingLights(capture), kMostLights, rig.lights,
      [](const capture::Light& light) { return light.name; },
      [](capture::Light& light, size_t i) { light.name = light.identity = lightName(i); });
}

void addLights(const scene::Entry& entry, const Point& center, StageRig& rig) {
  const scene::Section s(entry, {"count", "directions", "positions", "angles_deg", "from", "test",
                                 "irradiance", "distance", "radius_deg"});
  const std::string_view key = chosenOf(s, {"count", "directions", "positions", "angles_deg", "from"});
  const auto distance = s.find("distance"), radius = s.find("radius_deg");
  if ((distance || key == "positions") && radius) throw scene::mismatch(*radius, kNoExtent);
  if (radius) rig.lightRadius = Angle::fromDegrees(numberIn(*radius, 0.001, 89));
  if (key == "from") return addLightsFrom(s, rig);
  const Placement placement = asPlacement(s, key, center, kMostLights);
  rig.trainingLights = placement.training;
  const Rgb irradiance = asColor(s.require("irradiance"), 1e-3, 1e6);
  for (const Place& place : placement.all) {
    capture::Light light;
    light.name = light.identity = lightName(rig.lights.size());
    if (distance || place.distance) {
      const double d = distanceOf(place, distance, s);
      const Rgb intensity = material::scaled(d * d, irradiance);
      for (const float strength : {intensity.r, intensity.g, intensity.b})
        if (!(strength >= capture::kLeastStrength && strength <= capture::kMostStrength))
          throw scene::mismatch(s.require("irradiance"), "what times the squared distance is in 1e-12..1e12");
      light.kind = capture::PointLight{center + d * place.towards, intensity};
    } else {
      light.kind = capture::DirectionalLight{place.towards, irradiance};
    }
    rig.lights.push_back(std::move(light));
  }
}

} // namespace

StageRig asRig(const scene::Section& stage) {
  StageRig rig;
  const auto center = pointOr0(stage, "center");
  addViews(stage, center, rig);
  addLights(stage.require("lights"), center, rig);
  if (const size_t frames = rig.views.size() * rig.lights.size(); frames > kMostFrames)
    throw Error::mismatch(fmt::format("at most {} pictures, one of each view under each light", kMostFrames),
                          fmt::format("{} views and {} lights", rig.views.size(), rig.lights.size()))
        .at("views");
  for (const capture::View& view : rig.views) {
    const capture::Lens& lens = view.camera.lens;
    const double values = 3.0 * lens.width * lens.height * static_cast<double>(rig.lights.size());
    if (values > kMostValues)
      throw Error::mismatch(fmt::format("at most {:.3g} pixels under all lights", kMostValues / 3),
                            fmt::format("{:.3g}", values / 3))
          .at(stage.find("camera") ? "camera.size" : "views.from");
  }
  return rig;
}

} // namespace surflect::stage
