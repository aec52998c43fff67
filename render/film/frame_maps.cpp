#include "render/film/frame_maps.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace surflect::film {

namespace {

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

// AOV of which a map is made; empty for albedo, which is a picture of its own.
std::string layerOf(const std::string& map) {
  if (map == "albedo") return "";
  return map == "height" ? "depth" : map;
}

void requireMaps(const scene::Script& script, const method::Description& model) {
  for (const std::string& map : script.output->maps) {
    const auto refuse = [&](const std::string& why) {
      throw Error::mismatch("another map: " + why, '"' + map + '"').at("output.maps").in(script.path);
    };
    const std::string layer = layerOf(map);
    if (layer.empty() && model.isBaked) refuse("a model of photographs under fixed light has no albedo");
    if (!layer.empty() && !holds(model.aovs, layer))
      refuse(fmt::format("frames of {} have no {}", model.method, layer));
  }
}

// Heights up to which nothing is said, in radii of the model: its splats reach a little beyond their centres.
constexpr double kReach = 1.01;

HeightRange heightRange(const method::Description& model) {
  double radius = 0;
  for (const auto& point : model.points)
    radius = std::max(radius, (point.raw().cast<double>() - model.middle.raw()).norm());
  return {assume<Point3<ObjectSpace, double>>(model.middle.raw()), std::max(radius, 1e-9)};
}

} // namespace

FrameMaps::FrameMaps(const scene::Script& script, const method::Description& model)
    : output_(*script.output), rendered_(output_.aov), range_(heightRange(model)) {
  requireMaps(script, model);
  for (const std::string& map : output_.maps) {
    const std::string layer = layerOf(map);
    if (layer.empty()) continue;
    layers_.push_back(layer);
    if (!holds(rendered_, layer)) rendered_.push_back(layer);
  }
}

const std::vector<std::string>& FrameMaps::aovs(const ShotRenderer& shot, int frame) const {
  return shot.samples(frame) == 1 ? rendered_ : output_.aov;
}

FrameMaps::Made FrameMaps::make(ShotRenderer& shot, int frame, double scale,
                                method::FrameLayers& layers) const {
  Made made;
  if (output_.maps.empty()) return made;
  method::FrameLayers sharp;
  const bool isBlurred = shot.samples(frame) > 1;
  if (isBlurred && !layers_.empty()) sharp = shot.renderObject(frame, scale, layers_);
  const method::FrameLayers& object = isBlurred ? sharp : layers;
  const capture::Camera<ObjectSpace> camera = shot.camera(frame, scale);
  for (const std::string& map : output_.maps) {
    if (map == "albedo") {
      made.maps.push_back(albedoMap(shot.renderAlbedo(frame, scale).color));
    } else if (map == "normal") {
      made.maps.push_back(normalMap(object.color, object.aovs.at("normal"), camera));
    } else {
      HeightMap heights = heightMap(object.color, object.aovs.at("depth"), range_, camera);
      made.maps.push_back(std::move(heights.samples));
      if (heights.farthest && std::abs(*heights.farthest) > kReach * range_.radius)
        made.beyond = heights.farthest;
    }
  }
  std::erase_if(layers.aovs, [&](const auto& layer) { return !holds(output_.aov, layer.first); });
  return made;
}

} // namespace surflect::film
