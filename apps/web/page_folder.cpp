#include "apps/web/page_folder.h"

#include "apps/web/annotations.h"
#include "apps/web/relit_page.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"
#include "surfel/base/version.h"
#include "web/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <utility>

namespace surflect::web {

namespace {

constexpr std::string_view kPageEnd = ".html", kPartBegin = "term", kPartEnd = ".js";

std::string jsonText(const Json& value, int indent) {
  return value.dump(indent, ' ', true, Json::error_handler_t::replace);
}

// Returns whether a name is that of a term's script, term0.js and so on.
bool isTerm(std::string_view name) {
  if (!name.starts_with(kPartBegin) || !name.ends_with(kPartEnd)) return false;
  name.remove_prefix(kPartBegin.size());
  name.remove_suffix(kPartEnd.size());
  return !name.empty() && std::ranges::all_of(name, [](char c) { return c >= '0' && c <= '9'; });
}

// A page with the mark's texts in the places of TITLE and CREDIT.
std::string filled(std::string_view page, const PageMark& mark) {
  const std::pair<std::string_view, std::string> places[] = {{"TITLE", escaped(mark.title)},
                                                             {"CREDIT", escaped(mark.credit)}};
  std::string text;
  while (!page.empty()) {
    const auto* const place =
        std::ranges::find_if(places, [&](const auto& each) { return page.starts_with(each.first); });
    const bool isPlace = place != std::end(places);
    text += isPlace ? place->second : std::string(1, page.front());
    page.remove_prefix(isPlace ? place->first.size() : 1);
  }
  return text;
}

const PageFile& fileOf(std::string_view name) { return *std::ranges::find(kPage, name, &PageFile::name); }

} // namespace

PageMark earlierMark(const std::filesystem::path& folder) {
  PageMark mark;
  const std::filesystem::path file = folder / kMarkFile;
  std::error_code none;
  if (!std::filesystem::is_regular_file(file, none)) return mark;
  const Json read = Json::parse(readFile(file, kLargestText), nullptr, false);
  if (!read.is_object()) return mark;
  const std::pair<const char*, std::string*> texts[] = {
      {"title", &mark.title}, {"object", &mark.object}, {"credit", &mark.credit}};
  for (const auto& [key, text] : texts)
    if (const auto found = read.find(key); found != read.end() && found->is_string())
      *text = found->get<std::string>();
  for (const char* const key : {"scale", "pixels_per_mm"}) // the latter in pages of earlier versions
    if (const auto scale = read.find(key); scale != read.end() && scale->is_number())
      if (const auto value = scale->get<double>(); value >= kLeastScale && value <= kGreatestScale)
        mark.scale = value;
  return mark;
}

PageMark markOf(const PageMark& given, const PageMark& earlier, const std::string& name) {
  PageMark mark = given;
  if (given.object == earlier.object) {
    if (mark.title.empty()) mark.title = earlier.title;
    if (mark.credit.empty()) mark.credit = earlier.credit;
    if (!mark.scale) mark.scale = earlier.scale;
  }
  if (mark.title.empty()) mark.title = name;
  return mark;
}

bool isOfPage(std::string_view name) {
  static constexpr std::string_view kWritten[] = {"index.html", "tiles",          "data.js",        kPtmFile,
                                                  kMarkFile,    kAnnotationsFile, "annotations.js", "main.js",
                                                  "draw.js"}; // the last two by earlier versions
  return std::ranges::find(kWritten, name) != std::end(kWritten) || isTerm(name) ||
         (!name.ends_with(kPageEnd) && std::ranges::find(kPage, name, &PageFile::name) != std::end(kPage)) ||
         areEarlierAnnotations(name);
}

void writeText(const std::filesystem::path& path, std::string_view text) {
  std::ofstream file(path, std::ios::binary);
  file.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.flush()) throw Error("cannot write").in(path);
}

void writeScript(const std::filesystem::path& path, std::string_view function, const Json& value) {
  writeText(path, fmt::format("surflect.{}({});\n", function, jsonText(value, -1)));
}

void writePage(std::string_view page, const PageMark& mark, const std::filesystem::path& folder) {
  const std::string_view text = fileOf(page).text;
  for (const PageFile& file : kPage)
    if (text.find(fmt::format("\"{}\"", file.name)) != text.npos) writeText(folder / file.name, file.text);
  writeText(folder / "index.html", filled(text, mark));
  Json written = {{"surflect_page", page.substr(0, page.size() - kPageEnd.size())},
                  {"version", kVersion},
                  {"object", mark.object},
                  {"title", mark.title}};
  if (!mark.credit.empty()) written["credit"] = mark.credit;
  if (mark.scale) written["scale"] = *mark.scale;
  writeText(folder / kMarkFile, jsonText(written, 2) + "\n");
}

} // namespace surflect::web
