// Values in the JSON of a capture, checked, with errors that name the field.
#pragma once

#include "surfel/base/error.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace surflect::capture {

// Limits the nesting of JSON before it is parsed, because the library copies and prints values by recursion.
// The library's own callback would search a whole list for each element.
inline constexpr int kDeepestJson = 64; // more than descriptions by other programs need

// Prefix of the text up to where more than `deepest` lists and objects are nested; the whole text if they
// never are.
inline std::string_view shallowPart(std::string_view json, int deepest) {
  std::ptrdiff_t depth = 0;
  bool inString = false;
  for (size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (c == '"') inString = !inString;
    if (inString) {
      if (c == '\\') ++i;
      continue;
    }
    if ((c == '[' || c == '{') && ++depth > deepest) return json.substr(0, i);
    if (c == ']' || c == '}') --depth;
  }
  return json;
}

using Json = nlohmann::json;

// Throws Error with the line if the text is malformed or nested too deeply.
Json parseJson(std::string_view content);

// Text of a manifest: the object, and `checksum`, that of all its other fields.
std::string sealedText(Json object);
// Object of such a text. Throws Error unless `format`, `version` and `checksum` are as they must be.
Json parseSealed(std::string_view content, std::string_view format, std::initializer_list<int> versions);

// Value for messages: "nothing", "an object", "a list of 3", or the value itself, cut after 60 characters.
std::string shown(const Json& value);

// "lights[12]"
std::string element(const std::string& list, size_t index);

// Value of a key; null if the object lacks it.
const Json& valueAt(const Json& object, const char* key);
bool isNull(const Json& value);

// Parsed value of a key. A missing one is parsed as null, so that the error states what the parser expects.
template <class Parse> auto required(const Json& object, const char* key, Parse parse) {
  return atField(key, [&] { return parse(valueAt(object, key)); });
}

template <class Parse>
auto optional(const Json& object, const char* key, Parse parse) -> std::optional<decltype(parse(object))> {
  const Json& value = valueAt(object, key);
  if (isNull(value)) return std::nullopt;
  return atField(key, [&] { return parse(value); });
}

// ---------------------------------------------------------------------------------------------------------
// Parsers. Each throws Error for a value of another type or beyond its bounds.

const Json& objectOf(const Json& value);
const Json& listOf(const Json& value);
std::string textOf(const Json& value);
double numberOf(const Json& value);
// Positive strength, length or time; its bounds keep quotients finite.
double positiveOf(const Json& value);
// Coordinate of a position or principal point.
double coordinateOf(const Json& value);
// Width or height of a picture.
int pixelCountOf(const Json& value);
Vec3<double> tripleOf(const Json& value);
Vec3<double> boundedTripleOf(const Json& value);
Point3<AcquisitionSpace, double> pointOf(const Json& value);
// Strength of a light in each channel.
Rgb strengthsOf(const Json& value);
// Strength of a light in each channel, or one number for all three.
Rgb strengthsOrGrayOf(const Json& value);

bool isText(const Json& value, std::string_view text);

template <class Choice>
Choice oneOf(const Json& value, std::initializer_list<std::pair<const char*, Choice>> choices) {
  std::string expected;
  for (const auto& [name, choice] : choices) {
    if (isText(value, name)) return choice;
    expected += (expected.empty() ? "" : " or ") + std::string(name);
  }
  throw Error::mismatch(expected, shown(value));
}

// Parses the JSON of a capture frame by frame: a tree of all frames takes long to build and to free.

// Calls `begin` with the root, whose list of frames is empty, then `add` with each frame. Returns false if
// one pass does not suffice: the text is malformed or nested too deeply, there are no frames, a frame is no
// object, or a key follows the frames. Then some calls may have been made, and parseJson must be used.
bool streamFrames(std::string_view content, const std::function<void(const Json& root)>& begin,
                  const std::function<void(const Json& frame)>& add);

} // namespace surflect::capture
