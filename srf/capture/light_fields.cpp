#include "srf/capture/light_fields.h"

#include "surfel/base/nearest_name.h"

#include <cmath>
#include <string_view>

namespace surflect::capture {

namespace {

DirectionalLight readDirectional(const Json& light) {
  const Vec3<double> towards = required(light, "direction", [](const Json& value) {
    const Vec3<double> direction = tripleOf(value);
    const double found = direction.norm();
    if (!(std::abs(found - 1) <= 1e-3)) throw Error::mismatch("a unit vector", "length " + numberText(found));
    return Vec3<double>(std::abs(found - 1) > 1e-14 ? direction / found : direction);
  });
  return {assume<Direction3<AcquisitionSpace, double>>(towards), required(light, "irradiance", strengthsOf),
          optional(light, "irradiance_gradient", boundedTripleOf).value_or(Vec3<double>::Zero())};
}

PointLight readPoint(const Json& light) {
  return {required(light, "position", pointOf), required(light, "intensity", strengthsOf)};
}

} // namespace

Light readLight(const Json& value) {
  const Json& object = objectOf(value);
  Light light;
  light.name = required(object, "name", textOf);
  light.identity = optional(object, "cluster", textOf).value_or(light.name);
  const bool directional = required(object, "type", [](const Json& type) {
    return oneOf<bool>(type, {{"directional", true}, {"point", false}});
  });
  if (directional)
    light.kind = readDirectional(object);
  else
    light.kind = readPoint(object);
  return light;
}

size_t LightList::add(Light light) {
  const size_t index = lights_.size();
  if (!byName_.try_emplace(light.name, index).second)
    throw Error("a second light is called " + light.name).at("name");
  if (const auto* point = std::get_if<PointLight>(&light.kind)) byPoint_.try_emplace(keyOf(*point), index);
  lights_.push_back(std::move(light));
  return index;
}

size_t LightList::named(const Json& value) const {
  const std::string name = textOf(value);
  if (const auto known = byName_.find(name); known != byName_.end()) return known->second;
  if (lights_.empty()) throw Error::mismatch("no light, as the capture lists none", shown(value));
  std::vector<std::string_view> known;
  for (const Light& light : lights_) known.push_back(light.name);
  throw Error::mismatch("a light of the list (nearest: " + std::string(nearestName(name, known)) + ")",
                        shown(value));
}

std::optional<size_t> LightList::ofFrame(const Json& frame, size_t frameIndex) {
  const auto position = optional(frame, "pl_pos", pointOf);
  if (!position) return std::nullopt;
  const PointLight point{*position,
                         optional(frame, "pl_intensity", strengthsOrGrayOf).value_or(Rgb{1, 1, 1})};
  if (const auto known = byPoint_.find(keyOf(point)); known != byPoint_.end()) return known->second;
  const std::string name = element("pl_pos", frameIndex);
  return add({name, name, point});
}

LightList::PointKey LightList::keyOf(const PointLight& light) {
  const auto& [r, g, b] = light.intensity;
  return {light.position.x(), light.position.y(), light.position.z(), r, g, b};
}

} // namespace surflect::capture
