// Keys of transforms.json in all dialects, and their treatment: Blender's exporters and NeRF-synthetic,
// instant-ngp, nerfstudio, NRHints and GS3, NeuS2, D-NeRF, and our own.
#pragma once

#include "srf/capture/json_fields.h"

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace surflect::capture {

enum class KeyPlace { capture, light, frame };

// Collects the unknown keys of a description.
class UnknownKeys {
public:
  void add(const std::string& key, KeyPlace place) { ++counts_[{key, place}]; }
  // '2 keys are not known and passed over: "foo", "bar" (in 12 frames)'; empty if there are none.
  std::optional<std::string> note() const;

private:
  std::map<std::pair<std::string, KeyPlace>, size_t> counts_;
};

// Counts unknown keys. Throws Error for one that would change the meaning and is not supported.
void checkKeys(const Json& object, KeyPlace place, UnknownKeys& unknown);

} // namespace surflect::capture
