#include "apps/viewer/request.h"

#include "surfel/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace surflect::viewer {

namespace {

constexpr int kDeepestBody = 64;
constexpr size_t kLongestText = 1000;

// JSON for a message: cut short.
std::string shown(const Json& value) {
  const std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  return text.size() > 60 ? text.substr(0, 60) + ".." : text;
}

Malformed wrongValue(const char* key, const std::string& expected, const Json& found) {
  return Malformed(Error::mismatch(expected, shown(found)).at(key));
}

const Json& valueAt(const Json& body, const char* key) {
  const auto found = body.find(key);
  if (found == body.end()) throw Malformed(Error("missing").at(key));
  return *found;
}

bool switchAt(const Json& body, const char* key) {
  const auto found = body.find(key);
  if (found == body.end()) return false;
  if (!found->is_boolean()) throw wrongValue(key, "true or false", *found);
  return found->get<bool>();
}

// One of the words; the first one if the key is missing.
std::string wordAt(const Json& body, const char* key, std::initializer_list<const char*> words) {
  if (!body.contains(key)) return *words.begin();
  const Json& word = body[key];
  for (const char* const each : words)
    if (word == each) return each;
  std::string list;
  for (const char* const each : words) list += (list.empty() ? "\"" : ", \"") + std::string(each) + '"';
  throw wrongValue(key, "one of " + list, word);
}

Rgb colorAt(const Json& body, const char* key) {
  if (!body.contains(key)) return {};
  const Json& color = body[key];
  const auto isPart = [](const Json& part) { return part.is_number() && part >= 0 && part <= 1; };
  if (!color.is_array() || color.size() != 3 || !std::ranges::all_of(color, isPart))
    throw wrongValue(key, "three numbers in 0..1", color);
  return {color[0].get<float>(), color[1].get<float>(), color[2].get<float>()};
}

} // namespace

double numberAt(const Json& body, const char* key, double least, double most) {
  const Json& value = valueAt(body, key);
  const bool isInside = value.is_number() && value.get<double>() >= least && value.get<double>() <= most;
  if (!isInside) throw wrongValue(key, fmt::format("a number in {}..{}", least, most), value);
  return value.get<double>();
}

int wholeAt(const Json& body, const char* key, int least, int most) {
  const double number = numberAt(body, key, least, most);
  if (number != std::floor(number)) throw wrongValue(key, "a whole number", number);
  return static_cast<int>(number);
}

std::string textAt(const Json& body, const char* key) {
  const Json& value = valueAt(body, key);
  if (!value.is_string() || value.get_ref<const std::string&>().size() > kLongestText)
    throw wrongValue(key, fmt::format("a text of at most {} bytes", kLongestText), value);
  return value.get<std::string>();
}

Json parsedBody(const std::string& body) {
  Json json;
  try {
    json = Json::parse(body, [](int depth, Json::parse_event_t, Json&) {
      if (depth > kDeepestBody) throw Malformed(Error("more than 64 JSON values in one another"));
      return true;
    });
  } catch (const Json::exception& error) {
    throw Malformed(Error(fmt::format("not JSON: {}", error.what())));
  }
  if (!json.is_object()) throw Malformed(Error::mismatch("a JSON object", json.type_name()));
  return json;
}

FrameRequest frameRequest(const Json& body, size_t models) {
  static const std::set<std::string> kKeys = {
      "number",  "pane",     "model", "doc",  "frame",      "size", "quality", "options", "show", "light",
      "overlay", "exposure", "white", "tone", "background", "x",    "y",       "first",   "last", "before"};
  for (const auto& [key, value] : body.items())
    if (!kKeys.contains(key)) throw Malformed(Error("unknown key").at(key.substr(0, 60)));
  FrameRequest request;
  request.number = static_cast<uint64_t>(numberAt(body, "number", 0, 9e15));
  request.model = static_cast<size_t>(wholeAt(body, "model", 0, static_cast<int>(models) - 1));
  request.values = valueAt(body, "doc");
  if (!request.values.is_object()) throw wrongValue("doc", "an object", request.values);
  request.frame = wholeAt(body, "frame", -1'000'000, 2'000'000);
  const Json& size = valueAt(body, "size");
  if (!size.is_array() || size.size() != 2) throw wrongValue("size", "[width, height]", size);
  const Json sides = {{"size[0]", size[0]}, {"size[1]", size[1]}};
  request.width = wholeAt(sides, "size[0]", 1, kLargestSide);
  request.height = wholeAt(sides, "size[1]", 1, kLargestSide);
  if (int64_t{request.width} * request.height > kMostPixels)
    throw wrongValue("size", fmt::format("at most {} pixels", kMostPixels), size);
  request.isPreview = wordAt(body, "quality", {"preview", "full"}) == "preview";
  request.options = body.value("options", Json::object());
  if (!request.options.is_object()) throw wrongValue("options", "an object", request.options);
  if (body.contains("show")) request.show = textAt(body, "show");
  if (body.contains("light")) request.light = textAt(body, "light");
  request.hasOverlay = switchAt(body, "overlay");
  if (body.contains("exposure")) request.display.exposureStops = numberAt(body, "exposure", -30, 30);
  if (body.contains("white") && !body["white"].is_null())
    request.white = numberAt(body, "white", 1e-12, 1e12);
  request.display.tone = wordAt(body, "tone", {"none", "filmic"}) == "none" ? Tone::none : Tone::filmic;
  request.display.background = colorAt(body, "background");
  return request;
}

method::Setting settingOf(const Json& options, const method::Options& known) {
  method::Setting setting;
  for (const auto& [name, value] : options.items()) {
    const method::Option& row = method::rowOf(known, name);
    const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
    setting[name] = method::parseValue(row, text);
  }
  method::requireSetting(known, setting);
  return setting;
}

} // namespace surflect::viewer
