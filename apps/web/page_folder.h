// The folder of a page, which browsers open from a disk, where they read scripts but no other files:
//
//   index.html, style.css, *.js    the page
//   data.js and others             what the page shows, as scripts that hand values to functions of the page
//   surflect-page.json             marks the folder as a page that another export may replace
#pragma once

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace surflect::web {

using Json = nlohmann::ordered_json;

inline constexpr const char* kMarkFile = "surflect-page.json";
inline constexpr double kLeastScale = 1e-6, kGreatestScale = 1e6;

// Entries of a page that the next export of its object takes over: title, credit, and scale for lengths.
struct PageMark {
  std::string object; // hash of what was captured: of photographs, or of a model's cameras
  std::string title;
  std::string credit;          // who has rights in it; may be empty
  std::optional<double> scale; // pixels per millimetre of a picture, millimetres of a unit of a model
};

// Reads the mark of the page in a folder; of another folder, nothing.
PageMark earlierMark(const std::filesystem::path& folder);

// The mark of a new page. Its title is the one given, else that of the earlier page of the same object, else
// the object's name; likewise credit and scale.
PageMark markOf(const PageMark& given, const PageMark& earlier, const std::string& name);

// The mark of the page of an object, by its hash.
using CompleteMark = std::function<PageMark(const std::string& object)>;

// Returns whether exports write a file or folder of this name at the top of a page's folder.
bool isOfPage(std::string_view name);

// Writes a file.
void writeText(const std::filesystem::path& path, std::string_view text);
// Writes a script of the page's folder that calls a function of the page, with JSON in ASCII.
void writeScript(const std::filesystem::path& path, std::string_view function, const Json& value);
// Writes a page of the binary as index.html, and the files that it names and the binary has; and the mark.
void writePage(std::string_view page, const PageMark& mark, const std::filesystem::path& folder);

} // namespace surflect::web
