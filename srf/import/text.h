// Lines, words and numbers of other people's text files, and errors that say which line.
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
  std::string_view text; // without blanks at its ends; may be empty
};

// All lines of a file, empty ones too; views into the content. A byte order mark goes; lines end
// with a line feed, with a carriage return before it or not, or with carriage returns alone.
std::vector<TextLine> linesOf(std::string_view content);
// The lines that say something: neither empty nor a # comment.
std::vector<TextLine> sayingLinesOf(std::string_view content);

// Separated by blanks, or by any of the separators too.
std::vector<std::string_view> wordsOf(std::string_view text, std::string_view separators = "");

// The whole word as a finite number, read alike in every locale; throws Error.
double numberOf(std::string_view word);
// Whether numberOf() reads them all.
bool areNumbers(std::span<const std::string_view> words);
// Whether a word is digits alone, however many.
bool isNumber(std::string_view word);
// A whole number from 0 to 2^32 - 1; throws Error.
size_t countOf(std::string_view word);

// What a message can show of text from a file: short, printable, one line.
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

} // namespace surflect::importers
