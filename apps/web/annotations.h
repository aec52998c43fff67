// Annotations of a page: points and boxes with text.
//
//   { "annotations": [{ "x", "y", "width", "height": pixels of the full picture, "text" }] }
//
// x and y are the point, or the box's upper left corner; width and height are absent for a point.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace surflect::web {

// Name of the file in the folder of a page. Annotations in it are those of the page, and survive another
// export.
inline constexpr const char* kAnnotationsFile = "annotations.json";

// Text of no annotations.
std::string noAnnotations();

// Checks the text of a file. Throws Error with field, expected and found.
void checkAnnotations(std::string_view text, const std::filesystem::path& file);

} // namespace surflect::web
