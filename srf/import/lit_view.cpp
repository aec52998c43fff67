#include "srf/import/lit_view.h"

#include "srf/image/image_file.h"
#include "srf/import/text.h"
#include "surfel/error.h"
#include "surfel/file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>

namespace surflect {

namespace fs = std::filesystem;

namespace {

bool isDigit(char c) { return c >= '0' && c <= '9'; }
bool isNumber(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), isDigit);
}

std::string lowered(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// ---------------------------------------------------------------------------------------------------------
// Light files.

constexpr std::string_view kSeparators = ",;";

template <class Work> auto inLine(const TextLine& line, Work work) {
  try {
    return work();
  } catch (Error& e) {
    throw std::move(e).at(fieldOf(line));
  }
}

// The last three words; what stands before them is the name, which can have blanks.
LightEntry entryIn(const TextLine& line) {
  const std::vector<std::string_view> words = wordsOf(line.text, kSeparators);
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

// Row x, row y, row z.
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

std::vector<LightEntry> parseLights(std::string_view content) {
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
    for (size_t axis = 0; axis < 3; ++axis) rows[axis] = wordsOf(lines[axis].text, kSeparators);
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
  return a.size() < b.size();
}

namespace {

// ---------------------------------------------------------------------------------------------------------
// Photographs.

struct Folder {
  std::vector<fs::path> photographs; // in natural order
  fs::path mask;                     // empty: none
};

bool isPicture(const fs::path& path) {
  static const std::set<std::string> extensions{".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff",
                                                ".tga", ".bmp", ".ppm",  ".pgm", ".hdr"};
  return extensions.contains(lowered(path.extension().string()));
}

// "mask.png", "cat.mask.png", "cat_mask.png".
bool isMask(const fs::path& path) {
  const std::string stem = lowered(path.stem().string());
  return stem == "mask" || stem.ends_with(".mask") || stem.ends_with("_mask") || stem.ends_with("-mask");
}

Folder picturesIn(const SourceFiles& files) {
  Folder folder;
  std::error_code problem;
  for (fs::directory_iterator entry(files.root, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    const fs::path& path = entry->path();
    std::error_code ignored;
    if (!isPicture(path) || !fs::is_regular_file(path, ignored)) continue;
    files.check(path);
    if (!isMask(path)) {
      folder.photographs.push_back(path);
      continue;
    }
    if (!folder.mask.empty())
      throw Error("two masks: " + folder.mask.filename().string() + " and " + path.filename().string())
          .in(files.root);
    folder.mask = path;
  }
  if (problem) throw Error("cannot open (" + problem.message() + ")").in(files.root);
  std::sort(folder.photographs.begin(), folder.photographs.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a.filename(), y = b.filename();
    if (naturallyBefore(x, y) != naturallyBefore(y, x)) return naturallyBefore(x, y);
    return x < y; // "1.png" and "01.png"
  });
  return folder;
}

// By the name as it stands; by its last part, for lists written on another machine; by what a picture is
// called without its extension.
std::optional<fs::path> photographNamed(const std::string& name, const SourceFiles& files,
                                        const Folder& folder) {
  if (auto file = files.find(name)) return file;
  const std::string last = name.substr(name.find_last_of("/\\") + 1);
  for (const fs::path& photograph : folder.photographs)
    if (photograph.filename() == last || photograph.stem() == last) return photograph;
  return std::nullopt;
}

[[noreturn]] void throwCounts(size_t lights, size_t photographs) {
  throw Error::mismatch(std::to_string(lights) + ", as many as lights",
                        std::to_string(photographs) + " photographs");
}

std::vector<fs::path> photographsOf(const std::vector<LightEntry>& entries, const SourceFiles& files,
                                    const Folder& folder) {
  std::vector<fs::path> photographs;
  if (entries[0].name.empty()) {
    if (folder.photographs.size() != entries.size()) throwCounts(entries.size(), folder.photographs.size());
    return folder.photographs;
  }
  const bool ordinals = std::all_of(entries.begin(), entries.end(), [&](const LightEntry& entry) {
    return isNumber(entry.name) && !photographNamed(entry.name, files, folder);
  });
  if (ordinals) {
    if (folder.photographs.size() != entries.size()) throwCounts(entries.size(), folder.photographs.size());
    std::set<size_t> different;
    for (const LightEntry& entry : entries) different.insert(countOf(entry.name));
    const size_t first = *different.begin();
    if (different.size() != entries.size() || *different.rbegin() != first + entries.size() - 1)
      throw Error::mismatch("ordinals that follow each other", "others");
    for (const LightEntry& entry : entries)
      photographs.push_back(folder.photographs[countOf(entry.name) - first]);
    return photographs;
  }
  std::set<fs::path> different;
  for (const LightEntry& entry : entries) try {
      const auto photograph = photographNamed(entry.name, files, folder);
      if (!photograph) throw Error::mismatch("a picture in " + files.root.string(), shownText(entry.name));
      if (!different.insert(*photograph).second) throw Error(shownText(entry.name) + " is listed twice");
      photographs.push_back(*photograph);
    } catch (Error& e) {
      throw std::move(e).at("line " + std::to_string(entry.line));
    }
  return photographs;
}

// ---------------------------------------------------------------------------------------------------------
// Strengths.

std::optional<std::vector<Rgb>> intensitiesBeside(const fs::path& lights, size_t count) {
  const fs::path file = lights.parent_path() / "light_intensities.txt";
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const std::string content = readFile(file);
    const std::vector<TextLine> lines = sayingLinesOf(content);
    if (lines.size() != count)
      throw Error::mismatch(std::to_string(count) + " lines, one a light", std::to_string(lines.size()));
    std::vector<Rgb> strengths;
    for (const TextLine& line : lines)
      inLine(line, [&] {
        const std::vector<std::string_view> words = wordsOf(line.text, kSeparators);
        if (words.size() != 3) throw Error::mismatch("r g b", shownText(line.text));
        Rgb strength;
        for (const auto& [channel, word] :
             {std::pair(&strength.r, words[0]), std::pair(&strength.g, words[1]),
              std::pair(&strength.b, words[2])}) {
          const double value = numberOf(word);
          if (!(value >= 1e-12 && value <= 1e12))
            throw Error::mismatch("a strength above 0 (1e-12 to 1e12)", shownText(word));
          *channel = static_cast<float>(value);
        }
        strengths.push_back(strength);
      });
    return strengths;
  } catch (Error& e) {
    throw std::move(e).in(file);
  }
}

void addLights(Source& source, const std::vector<LightEntry>& entries, const std::vector<std::string>& names,
               const std::vector<Rgb>& strengths, bool positions) {
  for (size_t l = 0; l < entries.size(); ++l) try {
      const Vec3<double>& v = entries[l].vector;
      // A lamp has the square of its distance for strength.
      if (!(v.norm() >= 1e-6 && v.norm() <= (positions ? 1e6 : 1e9)))
        throw Error::mismatch(positions ? "a position off the origin, within 1e6 of it" : "a direction",
                              "length " + numberText(v.norm()));
      Light light{names[l], names[l], {}};
      if (positions)
        light.kind = PointLight{assume<Point3<AcquisitionSpace, double>>(v), strengths[l]};
      else
        light.kind =
            DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(v.normalized()), strengths[l]};
      source.capture.lights.push_back(std::move(light));
    } catch (Error& e) {
      throw std::move(e).at("line " + std::to_string(entries[l].line));
    }
}

// The intensity of lamps that give irradiance 1 at the origin on average.
float meanIntensity(const std::vector<LightEntry>& entries) {
  double irradiance = 0; // of lamps of intensity 1
  for (const LightEntry& entry : entries) irradiance += 1 / entry.vector.squaredNorm();
  return static_cast<float>(static_cast<double>(entries.size()) / irradiance);
}

Camera<AcquisitionSpace> frontCamera(PictureSize size, const LitViewOptions& options) {
  Lens lens{
      .width = size.width, .height = size.height, .centerX = size.width / 2., .centerY = size.height / 2.};
  double distance = 2 * options.height;
  if (options.fieldOfView) {
    const double tangent = std::tan(options.fieldOfView->radians() / 2);
    lens.focalX = lens.focalY = size.height / 2. / tangent;
    distance = options.height / 2 / tangent;
  } else {
    lens.model = Lens::Model::orthographic;
    lens.focalX = lens.focalY = size.height / options.height;
  }
  return {lens, {Mat3<double>::Identity(), Vec3<double>(0, 0, -distance)}};
}

} // namespace

std::optional<fs::path> findLights(const fs::path& folder) {
  std::optional<fs::path> found;
  std::error_code problem;
  for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    if (lowered(entry->path().extension().string()) != ".lp") continue;
    if (found)
      throw Error("two light files: " + found->filename().string() + " and " +
                  entry->path().filename().string() + "; --lights says which")
          .in(folder);
    found = entry->path();
  }
  if (found) return found;
  for (const char* name : {"lights.txt", "light_directions.txt"})
    if (std::error_code ignored; fs::is_regular_file(folder / name, ignored)) return folder / name;
  return std::nullopt;
}

Source readLitView(const fs::path& folder, const fs::path& lights, const LitViewOptions& options,
                   bool allowOutside) try {
  const std::vector<LightEntry> entries = parseLights(readFile(lights));
  Source source;
  source.files = {folder, allowOutside};
  const Folder pictures = picturesIn(source.files);
  const std::vector<fs::path> photographs = photographsOf(entries, source.files, pictures);

  std::vector<fs::path> names;
  for (const fs::path& photograph : photographs) names.push_back(photograph.filename());
  std::vector<std::string> lightNames = namesOfPictures(names);
  if (std::set<std::string>(lightNames.begin(), lightNames.end()).size() != lightNames.size())
    for (size_t l = 0; l < lightNames.size(); ++l) lightNames[l] = photographs[l].generic_string();

  const auto stated = intensitiesBeside(lights, entries.size());
  source.strengthsUnknown = !stated;
  const float alike = options.positions ? meanIntensity(entries) : 1;
  addLights(source, entries, lightNames,
            stated ? *stated : std::vector<Rgb>(entries.size(), Rgb{alike, alike, alike}), options.positions);

  source.capture.views.push_back({"front", frontCamera(readPictureSize(photographs[0]), options)});
  for (size_t l = 0; l < entries.size(); ++l)
    source.capture.frames.push_back(
        {.view = 0, .light = l, .picture = photographs[l], .mask = pictures.mask});

  if (stated) source.notes.push_back("light strengths from light_intensities.txt");
  const auto behind = std::count_if(entries.begin(), entries.end(),
                                    [](const LightEntry& entry) { return entry.vector[2] <= 0; });
  if (behind > 0)
    source.notes.push_back(std::to_string(behind) + " lights stand behind the picture's plane (z up to 0)");
  const auto unit = std::all_of(entries.begin(), entries.end(), [](const LightEntry& entry) {
    return std::abs(entry.vector.norm() - 1) < 0.01;
  });
  if (!options.positions && !unit)
    source.notes.push_back("directions were brought to length 1; if they are positions, say --positions");
  return source;
} catch (Error& e) {
  throw std::move(e).in(lights);
}

} // namespace surflect
