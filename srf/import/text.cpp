#include "srf/import/text.h"

#include "srf/image/image_file.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>

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

namespace fs = std::filesystem;

namespace {

void sortNaturally(std::vector<fs::path>& paths) {
  std::sort(paths.begin(), paths.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a, y = b;
    if (naturallyBefore(x, y) != naturallyBefore(y, x)) return naturallyBefore(x, y);
    return x < y; // decides between "1.png" and "01.png"
  });
}

} // namespace

bool naturallyBefore(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    if (!isDigit(a[0]) || !isDigit(b[0])) {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1), b.remove_prefix(1);
      continue;
    }
    const auto takeNumber = [](std::string_view& text) {
      text.remove_prefix(std::min(text.find_first_not_of('0'), text.size()));
      const auto end = std::find_if_not(text.begin(), text.end(), isDigit);
      const std::string_view digits = text.substr(0, static_cast<size_t>(end - text.begin()));
      text.remove_prefix(digits.size());
      return digits;
    };
    const std::string_view x = takeNumber(a), y = takeNumber(b);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  return a.empty() && !b.empty();
}

bool isHidden(const fs::path& path) { return path.filename().string().starts_with('.'); }

bool isFile(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

bool isFolder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

bool isMaskName(const fs::path& path) {
  const std::string stem = lowerCase(path.stem().string());
  return stem == "mask" || stem.ends_with(".mask") || stem.ends_with("_mask") || stem.ends_with("-mask");
}

std::vector<std::string> oddNames(const std::vector<fs::path>& pictures) {
  const auto patternOf = [](const fs::path& picture) {
    std::string pattern;
    for (const char c : lowerCase(picture.filename().string()))
      if (!isDigit(c))
        pattern += c;
      else if (!pattern.ends_with('#'))
        pattern += '#';
    return pattern;
  };
  std::map<std::string, size_t> counts;
  for (const fs::path& picture : pictures) ++counts[patternOf(picture)];
  std::vector<std::string> odd;
  for (const auto& [pattern, count] : counts) {
    if (2 * count <= pictures.size()) continue;
    for (const fs::path& picture : pictures)
      if (patternOf(picture) != pattern) odd.push_back(picture.filename());
  }
  return odd;
}

std::vector<fs::path> picturesIn(const fs::path& folder) {
  std::vector<fs::path> pictures;
  std::error_code problem, ignored;
  for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end; entry.increment(problem))
    if (image::isPictureName(entry->path()) && !isHidden(entry->path()) && entry->is_regular_file(ignored))
      pictures.push_back(entry->path());
  if (problem) throw Error("cannot open (" + problem.message() + ")").in(folder);
  image::removeDevelopedRaw(pictures);
  sortNaturally(pictures);
  return pictures;
}

std::vector<fs::path> picturesBelow(const fs::path& folder) {
  std::vector<fs::path> pictures;
  std::error_code problem, ignored;
  for (fs::recursive_directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    if (isHidden(entry->path()))
      entry.disable_recursion_pending();
    else if (image::isPictureName(entry->path()) && entry->is_regular_file(ignored))
      pictures.push_back(entry->path());
  }
  image::removeDevelopedRaw(pictures);
  sortNaturally(pictures);
  return pictures;
}

} // namespace surflect::importers
