// Lines, words and numbers of text files, with errors that name the line.
#pragma once

#include "surfel/base/error.h"

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace surflect::importers {

struct TextLine {
  size_t number = 0;     // from 1
  std::string_view text; // without leading and trailing blanks; may be empty
};

// All lines of a file, also empty ones, as views into the content. A byte order mark is removed. Lines end
// with LF, CR LF or CR.
std::vector<TextLine> linesOf(std::string_view content);
// Lines that are neither empty nor # comments.
std::vector<TextLine> sayingLinesOf(std::string_view content);

// Words separated by blanks, or also by the given separators.
std::vector<std::string_view> wordsOf(std::string_view text, std::string_view separators = "");

// Value of a word, all of which must be one finite number; independent of the locale. Throws Error.
double numberOf(std::string_view word);
// Returns whether numberOf() accepts all words.
bool areNumbers(std::span<const std::string_view> words);
inline bool isDigit(char c) { return c >= '0' && c <= '9'; }
// Returns whether a word consists of digits, however many.
bool isNumber(std::string_view word);
// A whole number from 0 to 2^32 - 1; throws Error.
size_t countOf(std::string_view word);

// Text from a file for messages: short, printable, one line.
std::string shownText(std::string_view text);

// "line 12": the field of an Error about a line.
std::string fieldOf(const TextLine& line);
// Returns work(); its Errors get the line as their field.
template <class Work> auto inLine(const TextLine& line, Work work) {
  try {
    return work();
  } catch (Error& e) {
    throw std::move(e).at(fieldOf(line));
  }
}

// Folder listings. Pictures are recognised by name alone.

// Natural order, 2 before 10: digits compare as numbers.
bool naturallyBefore(std::string_view a, std::string_view b);

// Returns whether the name is hidden: ".DS_Store", or "._photo.jpg", in which macOS keeps file attributes
// (AppleDouble).
bool isHidden(const std::filesystem::path& path);
// False if the path does not exist or cannot be accessed.
bool isFile(const std::filesystem::path& path);
bool isFolder(const std::filesystem::path& path);
// Returns whether a name is that of a mask: "mask.png", "cat.mask.png", "cat_mask.png", "cat-mask.png".
bool isMaskName(const std::filesystem::path& path);
// Pictures whose names differ from most, digits ignored: "Normal_gt.png" among "001.png", "002.png", ..; none
// if no name pattern is shared by most.
std::vector<std::string> oddNames(const std::vector<std::filesystem::path>& pictures);

// Pictures of a folder in natural order, without hidden ones and raw files of developed pictures
// (image::removeDevelopedRaw). Throws Error if the folder cannot be opened.
std::vector<std::filesystem::path> picturesIn(const std::filesystem::path& folder);
// Pictures of a folder and all folders below it; links to folders are not followed. The folder may be
// missing.
std::vector<std::filesystem::path> picturesBelow(const std::filesystem::path& folder);

} // namespace surflect::importers
