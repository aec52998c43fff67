#include "srf/import/listing.h"

#include "srf/image/image_file.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/lower_case.h"

#include <algorithm>
#include <map>

namespace surflect::importers {

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
  sortNaturally(pictures);
  return pictures;
}

} // namespace surflect::importers
