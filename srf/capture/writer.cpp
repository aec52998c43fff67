#include "srf/capture/writer.h"

#include "srf/capture/file_names.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>

namespace surflect::capture {

namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson listOf(const Vec3<double>& v) { return {v[0], v[1], v[2]}; }
OrderedJson listOf(Rgb c) { return {c.r, c.g, c.b}; }

OrderedJson lensJson(const Lens& lens) {
  OrderedJson json{{"w", lens.width}, {"h", lens.height}, {"cx", lens.centerX}, {"cy", lens.centerY}};
  if (lens.model == Lens::Model::orthographic) {
    assert(lens.focalX == lens.focalY);
    json["camera_model"] = "orthographic";
    json["ortho_height"] = lens.height / lens.focalY;
  } else {
    json["fl_x"] = lens.focalX;
    json["fl_y"] = lens.focalY;
  }
  if (lens.distorts()) json.update({{"k1", lens.k1}, {"k2", lens.k2}, {"p1", lens.p1}, {"p2", lens.p2}});
  if (lens.k3 != 0) json["k3"] = lens.k3;
  return json;
}

OrderedJson poseJson(const Rigid<CameraSpace, AcquisitionSpace>& cameraFromWorld) {
  const auto worldFromCamera = cameraFromWorld.inverse();
  const Mat3<double>& r = worldFromCamera.rotation();
  const Vec3<double>& t = worldFromCamera.translation();
  OrderedJson rows = OrderedJson::array();
  for (int row = 0; row < 3; ++row) rows.push_back({r(row, 0), r(row, 1), r(row, 2), t[row]});
  rows.push_back({0., 0., 0., 1.});
  return rows;
}

OrderedJson lightJson(const Light& light) {
  OrderedJson json{{"name", light.name}};
  if (const auto* directional = std::get_if<DirectionalLight>(&light.kind)) {
    json["type"] = "directional";
    json["direction"] = listOf(directional->towards.raw());
    json["irradiance"] = listOf(directional->irradiance);
    if (!directional->isEven()) json["irradiance_gradient"] = listOf(directional->irradianceGradient);
  } else {
    const auto& point = std::get<PointLight>(light.kind);
    json["type"] = "point";
    json["position"] = listOf(point.position.raw());
    json["intensity"] = listOf(point.intensity);
  }
  if (light.identity != light.name) json["cluster"] = light.identity;
  return json;
}

OrderedJson frameJson(const Capture& capture, const Frame& frame, const Exposure& shot, bool withLens) {
  const View& view = capture.views[frame.view];
  OrderedJson json{{"file_path", shot.picture.generic_string()}};
  if (!shot.layer.empty()) json["layer"] = shot.layer;
  if (!shot.alphaLayer.empty()) json["alpha_layer"] = shot.alphaLayer;
  json["camera"] = view.identity;
  if (frame.light) json["light"] = capture.lights[*frame.light].name;
  json["transform_matrix"] = poseJson(view.camera.cameraFromWorld);
  if (withLens) json.update(lensJson(view.camera.lens));
  if (shot.exposure != 1) json["exposure"] = shot.exposure;
  if (!frame.mask.empty()) json["mask_path"] = frame.mask.generic_string();
  json["split"] = frame.split == Split::train ? "train" : "test";
  return json;
}

// Refuses numbers that are not finite, which JSON would write as null.
void requireFinite(const OrderedJson& value) {
  if (value.is_number_float() && !std::isfinite(value.get<double>()))
    throw Error::mismatch("a finite number", numberText(value.get<double>()));
  if (!value.is_structured()) return;
  for (const auto& [key, inner] : value.items()) try {
      requireFinite(inner);
    } catch (Error& e) {
      throw std::move(e).at(value.is_array() ? "[" + key + "]" : key);
    }
}

std::string textOf(const std::string& field, const OrderedJson& value) try {
  requireFinite(value);
  return value.dump();
} catch (Error& e) {
  throw std::move(e).at(field);
}

// A list with one element per line.
template <class Items, class ToJson>
std::string lines(const std::string& field, const Items& items, ToJson toJson) {
  std::string text = "[";
  for (size_t i = 0; i < items.size(); ++i)
    text += (i > 0 ? ",\n  " : "\n  ") + textOf(field + "[" + std::to_string(i) + "]", toJson(items[i]));
  return text + "\n]";
}

} // namespace

namespace {

// The first name or path that is not UTF-8, for messages.
std::string oddName(const Capture& capture) {
  std::vector<std::string> names{capture.geometry.generic_string()};
  for (const Frame& frame : capture.frames) {
    for (const Exposure& shot : bracketOf(frame))
      names.insert(names.end(), {shot.picture.generic_string(), shot.layer, shot.alphaLayer});
    names.push_back(frame.mask.generic_string());
  }
  for (const View& view : capture.views) names.push_back(view.identity);
  for (const Light& light : capture.lights) names.insert(names.end(), {light.name, light.identity});
  const auto odd = std::ranges::find_if_not(names, isUtf8);
  return odd == names.end() ? "a name" : escapedName(*odd);
}

} // namespace

std::string captureText(const Capture& capture, const std::filesystem::path& folder) try {
  assert(!capture.views.empty());
  const Lens& firstLens = capture.views.front().camera.lens;
  const bool oneLens = std::all_of(capture.views.begin(), capture.views.end(),
                                   [&](const View& view) { return view.camera.lens == firstLens; });
  OrderedJson head = oneLens ? lensJson(firstLens) : OrderedJson::object();
  if (capture.colorSpace) head["color_space"] = *capture.colorSpace == ColorSpace::srgb ? "srgb" : "linear";
  if (capture.response) {
    const auto& [r, g, b] = capture.response->exposure;
    head["response"] = {{"r", r}, {"g", g}, {"b", b}};
  }
  if (!capture.geometry.empty()) head["geometry"] = capture.geometry.generic_string();
  if (!capture.origin.isZero(0)) head["origin"] = listOf(capture.origin);
  if (!capture.calibration.empty()) head["calibration"] = capture.calibration;

  std::string text = "{\n";
  for (const auto& [key, value] : head.items())
    text += OrderedJson(key).dump() + ": " + textOf(key, value) + ",\n";
  if (!capture.lights.empty()) text += "\"lights\": " + lines("lights", capture.lights, lightJson) + ",\n";
  std::vector<OrderedJson> shots;
  for (const Frame& frame : capture.frames)
    for (const Exposure& shot : bracketOf(frame)) shots.push_back(frameJson(capture, frame, shot, !oneLens));
  return text + "\"frames\": " + lines("frames", shots, std::identity()) + "\n}\n";
} catch (Error& e) {
  throw std::move(e).in(folder / "transforms.json");
} catch (const OrderedJson::type_error&) { // thrown by dump()
  throw Error(oddName(capture) + " is not UTF-8: rename it");
}

void writeCapture(const Capture& capture, const std::filesystem::path& folder) {
  writeFileAtomically(folder / "transforms.json", captureText(capture, folder));
}

void writeViewPictures(const std::filesystem::path& path, std::span<const RadianceLayer> layers,
                       const image::Image* alpha, const std::string& alphaLayer, image::Precision precision,
                       const Progress& progress) {
  const auto inLayer = [](const std::string& layer, const char* channel) {
    return layer.empty() ? channel : layer + "." + channel;
  };
  std::vector<image::ExrLayer> exrLayers;
  for (const auto& [layer, radiance] : layers) {
    assert(radiance->channels == 3);
    exrLayers.push_back(
        {{inLayer(layer, "R"), inLayer(layer, "G"), inLayer(layer, "B")}, radiance, precision, alpha});
  }
  if (alpha) exrLayers.push_back({{inLayer(alphaLayer, "A")}, alpha, precision});
  image::writeExr(path, exrLayers, {}, progress);
}

} // namespace surflect::capture
