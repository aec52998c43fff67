#include "srf/import/lit_view.h"

#include "srf/image/image_file.h"
#include "srf/import/ball_lamps.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <set>
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

namespace fs = std::filesystem;

namespace {

// ---------------------------------------------------------------------------------------------------------
// Photographs.

struct Folder {
  std::vector<fs::path> photographs; // in natural order
  fs::path mask;                     // empty: none
};

Folder photographsIn(const SourceFiles& files) {
  Folder folder;
  for (const fs::path& picture : picturesIn(files.root)) {
    files.check(picture);
    if (!isMaskName(picture)) {
      folder.photographs.push_back(picture);
      continue;
    }
    if (!folder.mask.empty())
      throw Error("two masks: " + folder.mask.filename().string() + " and " + picture.filename().string())
          .in(files.root);
    folder.mask = picture;
  }
  return folder;
}

// Ways in which a name in a list matches a picture.
enum class Likeness { exact, otherCase, otherExtension };

struct Named {
  fs::path photograph;
  Likeness likeness = Likeness::exact;
};

// Returns whether the name has an extension, which contains a letter: "IMG_0001.CR2", but not "photo.1".
bool hasExtension(const fs::path& name) {
  const std::string extension = name.extension();
  return extension.size() >= 3 && extension.size() <= 5 &&
         std::ranges::any_of(extension, [](unsigned char c) { return std::isalpha(c); });
}

// The single photograph that matches; throws Error if there are several.
std::optional<fs::path> onlyOne(const std::string& name, const Folder& folder, const auto& isAlike) {
  std::optional<fs::path> found;
  for (const fs::path& photograph : folder.photographs) {
    if (!isAlike(photograph)) continue;
    if (found)
      throw Error(shownText(name) + " can be " + found->filename().string() + " or " +
                  photograph.filename().string());
    found = photograph;
  }
  return found;
}

// Photograph by name. Tries the name itself; its last part, for lists from another machine; the name without
// extension; other letter case; and another extension, for raw files that were developed.
std::optional<Named> photographNamed(const std::string& name, const SourceFiles& files,
                                     const Folder& folder) {
  if (auto file = files.find(name)) return Named{*file};
  const std::string last = name.substr(name.find_last_of("/\\") + 1), low = lowerCase(last);
  for (const fs::path& photograph : folder.photographs)
    if (photograph.filename() == last || photograph.stem() == last) return Named{photograph};
  const auto isInOtherCase = [&](const fs::path& p) {
    return lowerCase(p.filename().string()) == low || lowerCase(p.stem().string()) == low;
  };
  if (const auto found = onlyOne(name, folder, isInOtherCase)) return Named{*found, Likeness::otherCase};
  if (!hasExtension(last)) return std::nullopt;
  const std::string stem = fs::path(low).stem();
  const auto isOfOtherExtension = [&](const fs::path& p) { return lowerCase(p.stem().string()) == stem; };
  if (const auto found = onlyOne(name, folder, isOfOtherExtension))
    return Named{*found, Likeness::otherExtension};
  return std::nullopt;
}

[[noreturn]] void throwCounts(size_t lights, const std::vector<fs::path>& photographs) {
  std::string found = std::to_string(photographs.size()) + " photographs";
  if (const auto odd = oddNames(photographs); !odd.empty())
    found += ", of which some are named otherwise (" + firstNames(odd) + ")";
  throw Error::mismatch(std::to_string(lights) +
                            ", as many as lights; a filenames.txt beside them can list those that count",
                        found);
}

// Throws Error about an unknown picture. If the name ends in numbers, the line has more than x y z.
[[noreturn]] void throwUnknown(const std::string& name, const SourceFiles& files) {
  const std::vector<std::string_view> words = wordsOf(name, kLightSeparators);
  size_t numbers = 0;
  while (numbers < words.size() && areNumbers(std::span(words).last(numbers + 1))) ++numbers;
  if (numbers > 0 && numbers < words.size())
    throw Error::mismatch("a name and x y z (are there decimal commas between commas?)",
                          std::to_string(numbers + 3) + " numbers after " + shownText(words[0]));
  throw Error::mismatch("a picture in " + files.root.string() +
                            " (import FOLDER --lights FILE states the pictures' folder; if the order of the "
                            "lines counts, write x y z alone, a line for each picture)",
                        shownText(name));
}

// Names of a list, one per line.
std::vector<LightEntry> listedNames(const fs::path& list) {
  std::vector<LightEntry> names;
  const std::string content = readFile(list, kLargestText);
  for (const TextLine& line : sayingLinesOf(content))
    names.push_back({std::string(line.text), Vec3<double>::Zero(), line.number});
  return names;
}

std::vector<fs::path> photographsNamed(const std::vector<LightEntry>& entries, const SourceFiles& files,
                                       const Folder& folder, std::vector<std::string>& notes) {
  std::vector<fs::path> photographs;
  std::set<fs::path> different;
  std::vector<std::string> otherCase, otherExtension;
  for (const LightEntry& entry : entries) try {
      const auto named = photographNamed(entry.name, files, folder);
      if (!named) throwUnknown(entry.name, files);
      const auto& [photograph, likeness] = *named;
      if (!different.insert(photograph).second) throw Error(shownText(entry.name) + " is listed twice");
      photographs.push_back(photograph);
      if (likeness == Likeness::exact) continue;
      (likeness == Likeness::otherCase ? otherCase : otherExtension)
          .push_back(photograph.filename().string() + " for " + shownText(entry.name));
    } catch (Error& e) {
      throw std::move(e).at("line " + std::to_string(entry.line));
    }
  const std::string all = " of " + std::to_string(entries.size()) + " names in the list ";
  if (!otherCase.empty())
    notes.push_back(
        std::to_string(otherCase.size()) + all +
        "differ from the pictures' in letter case, which is passed over: " + firstNames(otherCase));
  if (!otherExtension.empty())
    notes.push_back(std::to_string(otherExtension.size()) + all +
                    "have another extension than the pictures of the same name, which are taken: " +
                    firstNames(otherExtension));
  return photographs;
}

std::vector<fs::path> photographsOf(const std::vector<LightEntry>& entries, const SourceFiles& files,
                                    const Folder& folder, std::vector<std::string>& notes) {
  if (entries[0].name.empty()) {
    const fs::path list = files.root / "filenames.txt";
    if (std::error_code ignored; fs::is_regular_file(list, ignored)) try {
        const std::vector<LightEntry> names = listedNames(list);
        if (names.size() != entries.size())
          throw Error::mismatch(std::to_string(entries.size()) + ", as many as lights",
                                std::to_string(names.size()) + " names");
        notes.push_back("photographs are those that filenames.txt lists");
        return photographsNamed(names, files, folder, notes);
      } catch (Error& e) {
        throw std::move(e).in(list);
      }
    if (folder.photographs.size() != entries.size()) throwCounts(entries.size(), folder.photographs);
    return folder.photographs;
  }
  const bool ordinals = std::all_of(entries.begin(), entries.end(), [&](const LightEntry& entry) {
    return isNumber(entry.name) && !photographNamed(entry.name, files, folder);
  });
  if (!ordinals) return photographsNamed(entries, files, folder, notes);
  if (folder.photographs.size() != entries.size()) throwCounts(entries.size(), folder.photographs);
  std::vector<fs::path> photographs;
  std::set<size_t> different;
  for (const LightEntry& entry : entries) different.insert(countOf(entry.name));
  const size_t first = *different.begin();
  if (different.size() != entries.size() || *different.rbegin() != first + entries.size() - 1)
    throw Error::mismatch("ordinals that follow each other", "others");
  for (const LightEntry& entry : entries)
    photographs.push_back(folder.photographs[countOf(entry.name) - first]);
  return photographs;
}

// ---------------------------------------------------------------------------------------------------------
// Strengths.

std::optional<std::vector<Rgb>> intensitiesBeside(const fs::path& lights, size_t count) {
  const fs::path file = lights.parent_path() / "light_intensities.txt";
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const std::string content = withDecimalPoints(readFile(file));
    const std::vector<TextLine> lines = sayingLinesOf(content);
    if (lines.size() != count)
      throw Error::mismatch(std::to_string(count) + " lines, one a light", std::to_string(lines.size()));
    std::vector<Rgb> strengths;
    for (const TextLine& line : lines)
      inLine(line, [&] {
        const std::vector<std::string_view> words = wordsOf(line.text, kLightSeparators);
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

void addLights(ForeignCapture& source, const std::vector<LightEntry>& entries,
               const std::vector<std::string>& names, const std::vector<Rgb>& strengths, bool positions) {
  for (size_t l = 0; l < entries.size(); ++l) try {
      const Vec3<double>& v = entries[l].vector;
      // Positions are limited more, because the strength of a lamp is its squared distance.
      if (!(v.norm() >= 1e-6 && v.norm() <= (positions ? 1e6 : 1e9)))
        throw Error::mismatch(positions ? "a position off the origin, within 1e6 of it" : "a direction",
                              "length " + numberText(v.norm()));
      capture::Light light{names[l], names[l], {}};
      if (positions)
        light.kind = capture::PointLight{assume<Point3<AcquisitionSpace, double>>(v), strengths[l]};
      else
        light.kind = capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(v.normalized()),
                                               strengths[l]};
      source.capture.lights.push_back(std::move(light));
    } catch (Error& e) {
      throw std::move(e).at(entries[l].line > 0 ? "line " + std::to_string(entries[l].line)
                                                : "light " + shownText(names[l]));
    }
}

// Intensity of lamps with mean irradiance 1 at the origin.
float meanIntensity(const std::vector<LightEntry>& entries) {
  double irradiance = 0; // of lamps of intensity 1
  for (const LightEntry& entry : entries) irradiance += 1 / entry.vector.squaredNorm();
  return static_cast<float>(static_cast<double>(entries.size()) / irradiance);
}

capture::Camera<AcquisitionSpace> frontCamera(image::PictureSize size, const LitViewOptions& options) {
  capture::Lens lens{
      .width = size.width, .height = size.height, .centerX = size.width / 2., .centerY = size.height / 2.};
  double distance = 2 * options.height;
  if (options.fieldOfView) {
    const double tangent = std::tan(options.fieldOfView->radians() / 2);
    lens.focalX = lens.focalY = size.height / 2. / tangent;
    distance = options.height / 2 / tangent;
  } else {
    lens.model = capture::Lens::Model::orthographic;
    lens.focalX = lens.focalY = size.height / options.height;
  }
  return {lens, {Mat3<double>::Identity(), Vec3<double>(0, 0, -distance)}};
}

} // namespace

fs::path folderOfPhotographs(const fs::path& lights) {
  const fs::path folder = lights.has_parent_path() ? lights.parent_path() : ".";
  const fs::path pictures = folder / ".." / "jpeg-exports";
  const bool isOfProject = fs::absolute(folder).lexically_normal().filename() == "assembly-files";
  return isOfProject && isFolder(pictures) ? pictures.lexically_normal() : folder;
}

std::optional<fs::path> findLights(const fs::path& folder) {
  std::optional<fs::path> found;
  std::error_code problem;
  for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    if (lowerCase(entry->path().extension().string()) != ".lp" || isHidden(entry->path())) continue;
    if (found)
      throw Error("two light files: " + found->filename().string() + " and " +
                  entry->path().filename().string() + "; --lights says which")
          .in(folder);
    found = entry->path();
  }
  if (found) return found;
  for (const char* name : {"lights.txt", "light_directions.txt"})
    if (std::error_code ignored; fs::is_regular_file(folder / name, ignored)) return folder / name;
  if (const fs::path project = folder / "assembly-files"; isFolder(project)) return findLights(project);
  return std::nullopt;
}

namespace {

std::vector<LightEntry> entriesOf(const fs::path& lights, const LitViewOptions& options,
                                  ForeignCapture& source, const Progress& progress) {
  if (!options.chromeBall.empty()) {
    const std::vector<fs::path> balls = picturesIn(options.chromeBall);
    if (balls.empty()) throw Error("no pictures of the ball here").in(options.chromeBall);
    source.notes.push_back("directions of lights by reflections on a mirror ball");
    return lampsOfBallInOneView(options.chromeBall,
                                frontCamera(image::readPictureSize(balls[0]), options).lens, progress);
  }
  const std::string content = readFile(lights), points = withDecimalPoints(content);
  if (points != content) source.notes.push_back("the light file has decimal commas");
  return parseLights(points);
}

} // namespace

ForeignCapture readLitView(const fs::path& folder, const fs::path& lights, const LitViewOptions& options,
                           bool allowOutside, const Progress& progress) try {
  ForeignCapture source;
  source.files = {folder, allowOutside};
  const Folder pictures = photographsIn(source.files);
  const std::vector<LightEntry> entries = entriesOf(lights, options, source, progress);
  const std::vector<fs::path> photographs = photographsOf(entries, source.files, pictures, source.notes);

  std::vector<fs::path> names;
  for (const fs::path& photograph : photographs) names.push_back(photograph.filename());
  std::vector<std::string> lightNames = namesOfPictures(names);
  if (std::set<std::string>(lightNames.begin(), lightNames.end()).size() != lightNames.size())
    for (size_t l = 0; l < lightNames.size(); ++l) lightNames[l] = photographs[l].generic_string();

  const auto stated = options.chromeBall.empty() ? intensitiesBeside(lights, entries.size()) : std::nullopt;
  source.strengthsUnknown = !stated;
  const float alike = options.positions ? meanIntensity(entries) : 1;
  addLights(source, entries, lightNames,
            stated ? *stated : std::vector<Rgb>(entries.size(), Rgb{alike, alike, alike}), options.positions);

  source.capture.views.push_back({"front", frontCamera(image::readPictureSize(photographs[0]), options)});
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
  throw std::move(e).in(lights.empty() ? options.chromeBall : lights);
}

} // namespace surflect::importers
