#include "srf/import/text.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace surflect::importers {

namespace {

constexpr std::string_view kBlanks = " \t\r\v\f";

std::string_view trimmed(std::string_view text) {
  const size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

} // namespace

std::vector<TextLine> linesOf(std::string_view content) {
  if (content.starts_with("\xef\xbb\xbf")) content.remove_prefix(3);
  // Classic Mac OS ended lines with carriage returns alone.
  const char last = content.find('\n') == std::string_view::npos ? '\r' : '\n';
  std::vector<TextLine> lines;
  while (!content.empty()) {
    const size_t end = content.find(last);
    lines.push_back({lines.size() + 1, trimmed(content.substr(0, end))});
    content.remove_prefix(end == std::string_view::npos ? content.size() : end + 1);
  }
  return lines;
}

std::vector<TextLine> sayingLinesOf(std::string_view content) {
  std::vector<TextLine> lines = linesOf(content);
  std::erase_if(lines, [](const TextLine& line) { return line.text.empty() || line.text.front() == '#'; });
  return lines;
}

std::vector<std::string_view> wordsOf(std::string_view text, std::string_view separators) {
  const std::string between = std::string(kBlanks).append(separators);
  std::vector<std::string_view> words;
  for (size_t start = 0; (start = text.find_first_not_of(between, start)) != std::string_view::npos;) {
    const size_t end = std::min(text.find_first_of(between, start), text.size());
    words.push_back(text.substr(start, end - start));
    start = end;
  }
  return words;
}

double numberOf(std::string_view word) {
  std::string_view digits = word;
  if (digits.starts_with("+") && !digits.starts_with("+-")) digits.remove_prefix(1);
  double value = 0;
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (problem != std::errc() || end != digits.data() + digits.size() || !std::isfinite(value))
    throw Error::mismatch("a number", word.empty() ? "nothing" : shownText(word));
  return value;
}

bool areNumbers(std::span<const std::string_view> words) {
  return std::all_of(words.begin(), words.end(), [](std::string_view word) {
    try {
      return numberOf(word), true;
    } catch (const Error&) {
      return false;
    }
  });
}

bool isNumber(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == word.npos;
}

size_t countOf(std::string_view word) {
  uint32_t value = 0;
  const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (problem != std::errc() || end != word.data() + word.size())
    throw Error::mismatch("a whole number", word.empty() ? "nothing" : shownText(word));
  return value;
}

std::string shownText(std::string_view text) {
  constexpr size_t most = 60;
  std::string shown(text.substr(0, most));
  for (char& c : shown)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return '"' + shown + (text.size() > most ? "...\"" : "\"");
}

std::string fieldOf(const TextLine& line) { return "line " + std::to_string(line.number); }

} // namespace surflect::importers
