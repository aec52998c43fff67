#include "srf/import/light_file.h"

#include "srf/import/text.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace surflect::importers {

namespace {

// Returns whether a word is a number with decimal comma: "-0,75" or "1,5e-3".
bool isDecimalComma(std::string_view word) {
  const size_t comma = word.find(',');
  if (comma == word.npos || comma == 0 || comma + 1 == word.size()) return false;
  if (!isDigit(word[comma - 1]) || !isDigit(word[comma + 1])) return false;
  std::string number(word);
  number[comma] = '.';
  const std::string_view view = number;
  return word.find('.') == word.npos && areNumbers({&view, 1});
}

// An example of a number, with its line; empty if there is none.
struct Sample {
  std::string_view word;
  const TextLine* line = nullptr;
};

// Returns whether commas may separate numbers: all lines then have the same number of numbers, three or four.
bool canSeparate(const std::vector<TextLine>& lines) {
  size_t count = 0; // of the first line
  for (const TextLine& line : lines) {
    if (isNumber(line.text)) continue; // skips the number of lights
    const std::vector<std::string_view> words = wordsOf(line.text, kLightSeparators);
    if (count == 0) count = words.size();
    if (!areNumbers(words) || words.size() != count || count > 4) return false;
  }
  return true;
}

// Returns whether the file has decimal commas; throws as withDecimalPoints() does.
bool hasDecimalCommas(const std::vector<TextLine>& lines) {
  Sample comma, point; // first occurrence of each
  for (const TextLine& line : lines) {
    if (isNumber(line.text)) continue; // skips the number of lights
    const std::vector<std::string_view> words = wordsOf(line.text, ";");
    if (words.size() < 3) return false;
    for (const std::string_view word : std::span(words).last(3)) {
      const bool isComma = isDecimalComma(word);
      if (!isComma && !areNumbers({&word, 1})) return false;
      if (isComma && !comma.line) comma = {word, &line};
      if (word.find('.') != word.npos && !point.line) point = {word, &line};
    }
  }
  if (!comma.line) return false;
  if (point.line)
    throw Error::mismatch("either decimal commas or decimal points", shownText(comma.word) + ", and " +
                                                                         shownText(point.word) + " in " +
                                                                         fieldOf(*point.line))
        .at(fieldOf(*comma.line));
  if (canSeparate(lines))
    throw Error(shownText(comma.word) +
                " can be one number with a decimal comma, or two numbers; write decimal "
                "points, or separate by blanks")
        .at(fieldOf(*comma.line));
  return true;
}

// Light by the last three words of a line; the words before are the name, which may contain blanks.
LightEntry entryIn(const TextLine& line) {
  const std::vector<std::string_view> words = wordsOf(line.text, kLightSeparators);
  if (words.size() < 3) throw Error::mismatch("x y z, or a name before them", shownText(line.text));
  const auto last = words.end() - 3;
  LightEntry entry{"", {numberOf(last[0]), numberOf(last[1]), numberOf(last[2])}, line.number};
  if (words.size() > 3) {
    std::string_view name = line.text.substr(0, static_cast<size_t>(last[0].data() - line.text.data()));
    name = name.substr(0, name.find_last_not_of(" \t,;") + 1);
    if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
    entry.name = name;
  }
  return entry;
}

// Lights from rows of x, y and z.
std::vector<LightEntry> columnsOf(const std::array<std::vector<std::string_view>, 3>& rows,
                                  std::span<const TextLine> lines) {
  if (rows[0].empty()) throw Error("the file lists no light");
  std::vector<LightEntry> entries(rows[0].size());
  for (size_t axis = 0; axis < 3; ++axis)
    inLine(lines[axis], [&] {
      if (rows[axis].size() != entries.size())
        throw Error::mismatch(std::to_string(entries.size()) + " numbers, as in the first row",
                              std::to_string(rows[axis].size()));
      for (size_t l = 0; l < entries.size(); ++l) {
        entries[l].vector[static_cast<int>(axis)] = numberOf(rows[axis][l]);
        entries[l].line = lines[axis].number;
      }
    });
  return entries;
}

} // namespace

std::string withDecimalPoints(std::string_view content) {
  const std::vector<TextLine> lines = sayingLinesOf(content);
  std::string points(content);
  if (!hasDecimalCommas(lines)) return points;
  for (const TextLine& line : lines) {
    const std::vector<std::string_view> words = wordsOf(line.text, ";");
    // Last three words of a line with a name, which may contain a comma; otherwise all words.
    const bool isNamed = std::ranges::any_of(words, [](std::string_view word) {
      return !isDecimalComma(word) && !areNumbers({&word, 1});
    });
    for (const std::string_view word : isNamed ? std::span(words).last(3) : std::span(words))
      if (isDecimalComma(word))
        points[static_cast<size_t>(word.data() - content.data()) + word.find(',')] = '.';
  }
  return points;
}

std::vector<LightEntry> parseLights(std::string_view content) {
  if (content.starts_with("\xff\xfe") || content.starts_with("\xfe\xff"))
    throw Error::mismatch("UTF-8 (save the file in that encoding)", "text in UTF-16");
  std::vector<TextLine> lines = sayingLinesOf(content);
  if (lines.empty()) throw Error("the file lists no light");
  const bool counted = isNumber(lines[0].text);
  if (counted) {
    const TextLine first = lines[0];
    lines.erase(lines.begin());
    inLine(first, [&] {
      if (countOf(first.text) != lines.size() || lines.empty())
        throw Error::mismatch(std::to_string(lines.size()) + ", as many as lines follow",
                              std::string(first.text));
    });
  }
  if (!counted && lines.size() == 3) {
    std::array<std::vector<std::string_view>, 3> rows;
    for (size_t axis = 0; axis < 3; ++axis) rows[axis] = wordsOf(lines[axis].text, kLightSeparators);
    if (std::all_of(rows.begin(), rows.end(), areNumbers)) {
      if (rows[0].size() == 3 || rows[0].size() == 4)
        throw Error(
            "three lines of " + std::to_string(rows[0].size()) +
            " numbers can be lights or columns of lights; a first line \"3\" makes them three lights");
      return columnsOf(rows, lines);
    }
  }
  std::vector<LightEntry> entries;
  for (const TextLine& line : lines)
    inLine(line, [&] {
      entries.push_back(entryIn(line));
      if (entries.back().name.empty() != entries[0].name.empty())
        throw Error::mismatch(entries[0].name.empty() ? "no name, as in the lines before"
                                                      : "a name, as in the lines before",
                              shownText(line.text));
    });
  return entries;
}

} // namespace surflect::importers
