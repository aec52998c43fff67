// The keys of transforms.json in all its dialects, and what a reader makes of each: Blender's exporters and
// NeRF-synthetic, instant-ngp, nerfstudio, NRHints and GS3, NeuS2, D-NeRF, and our own.
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
  harmless,    // says nothing of what a photograph shows, or what the poses have in them already
  unsupported, // changes what photographs mean, unless its value says nothing: false, 0, "none"
  unknown
};

struct KeyRule {
  KeyUse use = KeyUse::unknown;
  std::string_view expected = {}; // of an unsupported key, for the Error
  std::string_view neutral = {};  // words, lower case, that say nothing under an unsupported key
};

KeyRule keyRule(std::string_view key, KeyPlace place);

// Keys and words come in any case; only ASCII changes.
std::string lowerCase(std::string_view ascii);

// The unknown keys of a description.
class UnknownKeys {
public:
  void add(const std::string& key, KeyPlace place) { ++counts_[{key, place}]; }
  // '2 keys are not known and passed over: "foo", "bar" (in 12 frames)'; empty where there are none.
  std::optional<std::string> note() const;

private:
  std::map<std::pair<std::string, KeyPlace>, size_t> counts_;
};

} // namespace surflect::capture
