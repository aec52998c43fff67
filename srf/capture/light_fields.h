// Lights in the JSON of a capture: listed by name, or written into every frame.
#pragma once

#include "srf/capture/json_fields.h"
#include "srf/capture/rig.h"

#include <array>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::capture {

Light readLight(const Json& value);

// Lights of a capture, found by name or by value.
class LightList {
public:
  // Throws Error if the name exists.
  size_t add(Light light);
  // Light of the name in `value`.
  size_t named(const Json& value) const;
  // Light that relighting sets write into a frame as "pl_pos" and "pl_intensity"; equal ones are one light.
  std::optional<size_t> ofFrame(const Json& frame, size_t frameIndex);

  std::vector<Light> take() && { return std::move(lights_); }

private:
  using PointKey = std::array<double, 6>; // position and intensity

  static PointKey keyOf(const PointLight& light);

  std::vector<Light> lights_;
  std::map<std::string, size_t> byName_;
  std::map<PointKey, size_t> byPoint_;
};

} // namespace surflect::capture
