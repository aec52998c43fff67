// Keys of transforms.json in all dialects, and their treatment: Blender's exporters and NeRF-synthetic,
// instant-ngp, nerfstudio, NRHints and GS3, NeuS2, D-NeRF, and our own.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace surflect::capture {

enum class KeyPlace { capture, light, frame };

enum class KeyUse {
  read,
  harmless,    // does not affect the photographs, or is already in the poses
  unsupported, // changes the meaning of photographs, unless its value is neutral: false, 0, "none"
  unknown
};

struct KeyRule {
  KeyUse use = KeyUse::unknown;
  std::string_view expected = {}; // for the Error about an unsupported key
  std::string_view neutral = {};  // lower-case words that are neutral under an unsupported key
};

KeyRule keyRule(std::string_view key, KeyPlace place);

// Text in lower case; only ASCII letters change.
std::string lowerCase(std::string_view ascii);

// Collects the unknown keys of a description.
class UnknownKeys {
public:
  void add(const std::string& key, KeyPlace place) { ++counts_[{key, place}]; }
  // '2 keys are not known and passed over: "foo", "bar" (in 12 frames)'; empty if there are none.
  std::optional<std::string> note() const;

private:
  std::map<std::pair<std::string, KeyPlace>, size_t> counts_;
};

} // namespace surflect::capture
