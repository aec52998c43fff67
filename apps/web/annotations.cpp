#include "apps/web/annotations.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>

namespace surflect::web {

namespace {

using nlohmann::json;

constexpr size_t kMostAnnotations = 10000;
constexpr double kFarthestPixel = 1 << 20;
constexpr std::array<std::string_view, 5> kKeys{"x", "y", "width", "height", "text"};

void checkAnnotation(const json& note) {
  if (!note.is_object()) throw Error::mismatch("an object", note.type_name());
  for (const auto& [key, value] : note.items()) {
    if (std::ranges::find(kKeys, key) == kKeys.end()) throw Error("unknown" + didYouMean(key, kKeys)).at(key);
    if (key == "text" ? !value.is_string() : !value.is_number())
      throw Error::mismatch(key == "text" ? "text" : "a number", value.type_name()).at(key);
    if (key != "text" && !(std::abs(value.get<double>()) <= kFarthestPixel))
      throw Error::mismatch(fmt::format("pixels up to {}", kFarthestPixel), value.dump()).at(key);
  }
  for (const char* const key : {"x", "y", "text"})
    if (!note.contains(key)) throw Error("missing").at(key);
  if (note.contains("width") != note.contains("height"))
    throw Error("missing beside the other side of the box").at(note.contains("width") ? "height" : "width");
}

} // namespace

std::string noAnnotations() { return "{ \"annotations\": [] }\n"; }

void checkAnnotations(std::string_view text, const std::filesystem::path& file) {
  inFile(file, [&] {
    const json read = json::parse(text, nullptr, false);
    if (read.is_discarded()) throw Error("is no JSON");
    if (!read.is_object() || !read.contains("annotations") || !read["annotations"].is_array())
      throw Error::mismatch("a list", "none").at("annotations");
    const json& notes = read["annotations"];
    if (notes.size() > kMostAnnotations)
      throw Error::mismatch(fmt::format("at most {}", kMostAnnotations), std::to_string(notes.size()))
          .at("annotations");
    for (size_t i = 0; i < notes.size(); ++i)
      atField(fmt::format("annotations[{}]", i), [&] { checkAnnotation(notes[i]); });
  });
}

} // namespace surflect::web
