// Requests of pages, read from JSON that anybody may have written.
#pragma once

#include "apps/viewer/display.h"
#include "render/method/option.h"
#include "surfel/base/error.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace surflect::viewer {

using Json = nlohmann::json;

// Largest side of a picture that a page may ask for, and most pixels: those of 4K.
inline constexpr int kLargestSide = 4096;
inline constexpr int64_t kMostPixels = 4096 * 2160;

// Error of a request that cannot be understood, as opposed to one for a mistaken script.
class Malformed : public Error {
public:
  explicit Malformed(const Error& error) : Error(error) {}
};

// Parses a body. Throws Malformed unless it is a JSON object of at most 64 levels.
Json parsedBody(const std::string& body);

// A picture of a script's frame, or of a photograph.
struct FrameRequest {
  uint64_t number = 0; // of the state, chosen by the page
  size_t model = 0;
  Json values; // of the script
  int frame = 0;
  int width = 0, height = 0;
  bool isPreview = false;
  Json options;               // given values by option, as JSON
  std::string show = "color"; // or an AOV, "photograph", "match", "error"
  std::string camera, light;  // of a photograph
  bool hasOverlay = false;    // outlines of mesh and mask over a photograph
  DisplayOptions display;
  std::optional<double> white = {}; // display.white; none: of this picture
};

// Throws Malformed naming the field: unknown keys, missing ones, and values that no request can have.
// models: how many there are.
FrameRequest frameRequest(const Json& body, size_t models);

// Values of options, as a setting. Throws Error as parseValue and requireSetting.
method::Setting settingOf(const Json& options, const method::Options& known);

// A field of a body. Throw Malformed.
double numberAt(const Json& body, const char* key, double least, double most);
int wholeAt(const Json& body, const char* key, int least, int most);
std::string textAt(const Json& body, const char* key);

} // namespace surflect::viewer
