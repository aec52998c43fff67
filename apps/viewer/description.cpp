#include "apps/viewer/description.h"

#include "render/methods.h"
#include "render/scene/turntable.h"
#include "srf/capture/origin.h"
#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace surflect::viewer {

namespace {

using Json = nlohmann::json;

Json jsonOf(const Vec3<double>& v) { return {v.x(), v.y(), v.z()}; }

Json jsonOf(const method::Value& value) {
  return value.isNumber() ? Json(value.number()) : Json(value.text());
}

Json jsonOf(const method::Option& option) {
  Json json = {{"name", option.name},
               {"help", option.help},
               {"standard", option.standard ? jsonOf(*option.standard) : Json()}};
  if (const auto* range = std::get_if<method::Range>(&option.domain)) {
    json["least"] = range->least;
    json["most"] = range->most;
    json["whole"] = range->isWhole;
  } else {
    for (const method::Value& choice : std::get<std::vector<method::Value>>(option.domain))
      json["choices"].push_back(jsonOf(choice));
  }
  if (option.preview) json["preview"] = jsonOf(*option.preview);
  if (option.needs) {
    Json values = Json::array();
    for (const method::Value& value : option.needs->second) values.push_back(jsonOf(value));
    json["needs"] = {option.needs->first, values};
  }
  return json;
}

Json jsonOf(const capture::View& view) {
  const Mat3<double> rotation = view.camera.cameraFromWorld.rotation();
  const capture::Lens& lens = view.camera.lens;
  const bool isPinhole = lens.model == capture::Lens::Model::pinhole;
  return {{"name", view.identity},
          {"position", jsonOf(view.camera.center().raw())},
          {"forward", jsonOf(Vec3<double>(-rotation.row(2).transpose()))},
          {"up", jsonOf(Vec3<double>(rotation.row(1).transpose()))},
          {"fov_deg", isPinhole ? 360 / std::numbers::pi * std::atan(0.5 * lens.height / lens.focalY) : 1},
          {"width", lens.width},
          {"height", lens.height},
          {"heldOut", false}};
}

Json jsonOf(const capture::Light& light) {
  Json json = {{"name", light.identity}};
  if (const auto* directional = std::get_if<capture::DirectionalLight>(&light.kind)) {
    json["type"] = "directional";
    json["direction"] = jsonOf(directional->towards.raw());
    json["irradiance"] = {directional->irradiance.r, directional->irradiance.g, directional->irradiance.b};
  } else {
    const auto& point = std::get<capture::PointLight>(light.kind);
    json["type"] = "point";
    json["position"] = jsonOf(point.position.raw());
    json["intensity"] = {point.intensity.r, point.intensity.g, point.intensity.b};
  }
  return json;
}

void describeRig(DescribedModel& model) {
  model.json["up"] = jsonOf(scene::upOf(model.rig));
  model.json["origin"] = jsonOf(model.rig.origin);
  model.json["middle"] = jsonOf(model.middle.raw());
  model.json["radius"] = model.radius;
  model.json["hasPhotographs"] = false;
  model.json["cameras"] = Json::array();
  model.json["lights"] = Json::array();
  model.json["photographs"] = Json::array();
  for (const capture::View& view : model.rig.views) model.json["cameras"].push_back(jsonOf(view));
  for (const capture::Light& light : model.rig.lights) model.json["lights"].push_back(jsonOf(light));
}

} // namespace

DescribedModel described(const std::string& name, const method::Renderer& renderer,
                         const method::Setting& given) {
  const method::Description& of = renderer.describe();
  const method::Method& method = method::methodOf(of.method);
  DescribedModel model{.name = name,
                       .method = of.method,
                       .rig = of.rig,
                       .options = {renderer.options().begin(), renderer.options().end()},
                       .aovs = of.aovs,
                       .middle = of.middle,
                       .isBaked = of.isBaked,
                       .json = {}};
  std::erase_if(model.options, [](const method::Option& option) { return option.atOpening; });
  double radius = 0;
  for (const auto& point : of.points)
    radius = std::max(radius, (point.raw().template cast<double>() - of.middle.raw()).norm());
  if (radius > 0) model.radius = radius;
  model.json = {{"name", name},
                {"method", of.method},
                {"title", method.title},
                {"paper", method.paper},
                {"relights", !of.isBaked && !of.rig.lights.empty()},
                {"deforms", !of.isBaked},
                {"aovs", of.aovs},
                {"options", Json::array()}};
  if (of.isBaked)
    model.json["why"] = "light and shape are those of the photographs";
  else if (of.rig.lights.empty())
    model.json["why"] = "the photographs were taken under one fixed light";
  for (method::Option option : model.options) {
    if (const auto chosen = given.find(option.name); chosen != given.end()) option.standard = chosen->second;
    model.json["options"].push_back(jsonOf(option));
  }
  describeRig(model);
  return model;
}

DescribedModel described(const capture::Capture& capture) {
  const Vec3<double> middle = capture::middleOfAxes(capture.views);
  double distance = std::numeric_limits<double>::infinity(); // of the nearest camera
  for (const capture::View& view : capture.views)
    distance = std::min(distance, (view.camera.center().raw() - middle).norm());
  DescribedModel model{.name = capture.file.parent_path().filename().string(),
                       .method = "capture",
                       .rig = capture,
                       .options = {},
                       .aovs = {},
                       .middle = assume<Point3<AcquisitionSpace, double>>(middle),
                       .radius = std::isfinite(distance) && distance > 0 ? 0.4 * distance : 1,
                       .isBaked = true,
                       .json = {}};
  model.json = {{"name", model.name},
                {"method", "capture"},
                {"title", "photographs that are not packed yet"},
                {"paper", ""},
                {"relights", false},
                {"deforms", false},
                {"why", "photographs are shown as they were taken: pack makes a model of them"},
                {"aovs", Json::array()},
                {"options", Json::array()}};
  describeRig(model);
  return model;
}

void addPhotographs(const capture::Capture& capture, DescribedModel& model) {
  std::map<std::string, size_t> cameras, lights;
  for (size_t i = 0; i < model.rig.views.size(); ++i) cameras.emplace(model.rig.views[i].identity, i);
  for (size_t i = 0; i < model.rig.lights.size(); ++i) lights.emplace(model.rig.lights[i].identity, i);
  const capture::Capture moved = capture::countedFrom(capture, model.rig.origin);
  for (const capture::Frame& frame : moved.frames) {
    const bool isHeldOut = frame.split == capture::Split::test;
    const capture::View& view = moved.views[frame.view];
    const auto [camera, isNewCamera] = cameras.emplace(view.identity, cameras.size());
    if (isNewCamera) {
      model.heldOut.push_back(view);
      model.json["cameras"].push_back(jsonOf(view));
      model.json["cameras"].back()["heldOut"] = true;
    }
    int light = -1;
    if (frame.light) {
      const auto [known, isNewLight] = lights.emplace(moved.lights[*frame.light].identity, lights.size());
      if (isNewLight) model.json["lights"].push_back(jsonOf(moved.lights[*frame.light]));
      light = static_cast<int>(known->second);
    }
    model.json["photographs"].push_back({camera->second, light, isHeldOut});
  }
  model.json["hasPhotographs"] = true;
}

} // namespace surflect::viewer
