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

// Writes text that was checked into the folder of a page: the file, and the script that hands it to the page.
void writeAnnotations(std::string_view text, const std::filesystem::path& folder);

// Returns whether a file of this name holds earlier annotations, annotations.1.json and so on.
bool areEarlierAnnotations(std::string_view name);

// Copies the annotations of an earlier page that a new one would lose: files of earlier annotations, and
// those of the page, under the next such name, where their text is not `published`. Returns that name; empty
// if nothing would be lost.
std::string keepEarlierAnnotations(const std::filesystem::path& earlier, const std::filesystem::path& page,
                                   std::string_view published);

} // namespace surflect::web
