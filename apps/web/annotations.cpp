#include "apps/web/annotations.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

namespace surflect::web {

namespace {

using nlohmann::json;

constexpr size_t kMostAnnotations = 10000;
constexpr double kFarthestPixel = 1 << 20;
constexpr std::string_view kEarlierBegin = "annotations.", kEarlierEnd = ".json";
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

void writeAnnotations(std::string_view text, const std::filesystem::path& folder) {
  const auto write = [&](const char* name, std::string_view content) {
    std::ofstream file(folder / name, std::ios::binary);
    file.write(content.data(), static_cast<std::streamsize>(content.size()));
    if (!file.flush()) throw Error("cannot write").in(folder / name);
  };
  write(kAnnotationsFile, text);
  write("annotations.js", fmt::format("surflect.annotations({});\n",
                                      json::parse(text).dump(-1, ' ', true, json::error_handler_t::replace)));
}

bool areEarlierAnnotations(std::string_view name) {
  if (name.size() <= kEarlierBegin.size() + kEarlierEnd.size() || !name.starts_with(kEarlierBegin) ||
      !name.ends_with(kEarlierEnd))
    return false;
  name.remove_prefix(kEarlierBegin.size());
  name.remove_suffix(kEarlierEnd.size());
  return std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
}

std::string keepEarlierAnnotations(const std::filesystem::path& earlier, const std::filesystem::path& page,
                                   std::string_view published) {
  std::error_code none;
  for (std::filesystem::directory_iterator entry(earlier, none), end; !none && entry != end;
       entry.increment(none))
    if (const std::string name = entry->path().filename().string(); areEarlierAnnotations(name))
      copyFile(entry->path(), page / name, {});
  const std::filesystem::path file = earlier / kAnnotationsFile;
  if (!std::filesystem::exists(file, none)) return {};
  if (const std::string text = readFile(file, kLargestText); text == published || text == noAnnotations())
    return {};
  for (int copy = 1;; ++copy) {
    std::string name = fmt::format("{}{}{}", kEarlierBegin, copy, kEarlierEnd);
    if (std::filesystem::exists(page / name, none)) continue;
    copyFile(file, page / name, {});
    return name;
  }
}

} // namespace surflect::web
