#include "srf/import/transforms.h"

#include "srf/capture/json_fields.h"
#include "srf/import/text.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <set>

namespace surflect::importers {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

enum class Part { train, validation, test, none };

// ---------------------------------------------------------------------------------------------------------
// Renames other programs' keys to the reader's. Values of a wrong type stay, so that the reader reports them.

// Replaces [cx, cy, fl_x, fl_y] of NRHints and GS3.
void spellOutIntrinsics(Json& object) {
  const auto list = object.find("camera_intrinsics");
  if (list == object.end() || !list->is_array() || list->size() != 4) return;
  constexpr std::array keys{"cx", "cy", "fl_x", "fl_y"};
  const Json values = *list;
  for (size_t i = 0; i < 4; ++i) object[keys[i]] = values[i];
  object.erase("camera_intrinsics");
}

// NRHints stores the extension separately; GS3's img_path overrides file_path.
void spellOutPath(Json& frame) {
  const auto path = frame.find("file_path"), extension = frame.find("file_ext"),
             whole = frame.find("img_path");
  if (whole != frame.end() && whole->is_string())
    frame["file_path"] = *whole;
  else if (path != frame.end() && path->is_string() && extension != frame.end() && extension->is_string())
    *path = path->get<std::string>() + extension->get<std::string>();
  else
    return;
  frame.erase("img_path");
  frame.erase("file_ext");
}

// ---------------------------------------------------------------------------------------------------------
// Splits.

// Normalised name: "./images\\a.png" equals "images/a.png".
std::string comparable(std::string name) {
  std::replace(name.begin(), name.end(), '\\', '/');
  return fs::path(name).lexically_normal();
}

// Removes a list from the root and returns its names.
std::set<std::string> takeNames(Json& root, const char* key) {
  std::set<std::string> names;
  const auto list = root.find(key);
  if (list == root.end() || !list->is_array()) return names;
  for (const Json& name : *list)
    if (name.is_string()) names.insert(comparable(name.get<std::string>()));
  root.erase(list);
  return names;
}

// nerfstudio's lists of file names; unlisted frames are not used.
struct SplitLists {
  std::set<std::string> train, validation, test;

  explicit SplitLists(Json& root)
      : train(takeNames(root, "train_filenames")), validation(takeNames(root, "val_filenames")),
        test(takeNames(root, "test_filenames")) {}

  bool given() const { return !train.empty() || !validation.empty() || !test.empty(); }
  Part of(const std::string& name) const {
    if (train.contains(name)) return Part::train;
    if (test.contains(name)) return Part::test;
    return validation.contains(name) ? Part::validation : Part::none;
  }
  // Throws Error if the listed names differ from those of the frames, and frames are left over.
  void check(const Json& frames, bool noneNamed, bool noneTrains) const {
    if (!noneNamed && (train.empty() || !noneTrains)) return;
    const char* key = !train.empty() ? "train_filenames" : !test.empty() ? "test_filenames" : "val_filenames";
    const std::set<std::string>& names = !train.empty() ? train : !test.empty() ? test : validation;
    throw Error::mismatch("the file_path of a frame, such as " + shownText(frames[0].value("file_path", "")),
                          shownText(*names.begin()) +
                              (names.size() > 1
                                   ? " and " + std::to_string(names.size() - 1) + " more, of no frame"
                                   : ", of no frame"))
        .at(key);
  }
};

// Split of a frame; throws Error for an unknown one.
Part partOf(const Json& frame, const SplitLists& lists, Part ofFile) {
  const auto path = frame.find("file_path"), split = frame.find("split");
  if (lists.given() && path != frame.end() && path->is_string())
    return lists.of(comparable(path->get<std::string>()));
  if (split == frame.end() || !split->is_string()) return ofFile;
  if (*split == "val" || *split == "valid" || *split == "validation") return Part::validation;
  if (*split == "test") return Part::test;
  if (*split == "train") return Part::train;
  throw Error::mismatch("train, val or test", shownText(split->get<std::string>())).at("split");
}

// ---------------------------------------------------------------------------------------------------------

// Facts about the files for notes to the user.
struct Findings {
  std::vector<std::string> notes;
  size_t lamps = 0, lampsWithoutStrength = 0; // photographs with pl_pos; those without pl_intensity
  size_t filled = 0;                          // of those without, got the strength that all others state
  std::set<std::string> strengths = {};       // stated ones, as JSON
};

bool says(const Json& frame, const char* key) { return frame.contains(key) && !frame[key].is_null(); }

bool hasLamp(const Json& frame) {
  return frame.is_object() && !says(frame, "light") && says(frame, "pl_pos");
}

// Gives lamps without strength that of all others. Throws Error if these differ. If none states one, the
// reader assumes 1.
void settleLamps(Json& frames, Findings& findings) {
  for (const Json& frame : frames)
    if (hasLamp(frame) && says(frame, "pl_intensity"))
      findings.strengths.insert(frame["pl_intensity"].dump());
  for (size_t f = 0; f < frames.size(); ++f) {
    Json& frame = frames[f];
    if (!hasLamp(frame)) continue;
    ++findings.lamps;
    if (says(frame, "pl_intensity")) continue;
    ++findings.lampsWithoutStrength;
    if (findings.strengths.size() > 1)
      throw Error::mismatch("a strength, as other frames state, each its own", "nothing")
          .at("pl_intensity")
          .at("frames[" + std::to_string(f) + "]");
    if (findings.strengths.empty()) continue;
    frame["pl_intensity"] = Json::parse(*findings.strengths.begin());
    ++findings.filled;
  }
}

void sayLamps(const Findings& findings, ForeignCapture& source) {
  const size_t unknown = findings.lampsWithoutStrength, all = findings.lamps, filled = findings.filled;
  if (unknown == 0) return;
  if (unknown > filled && !findings.strengths.empty())
    throw Error::mismatch("a pl_intensity in all of them, or in none", "one in some photographs alone")
        .in(source.files.root);
  if (filled > 0) {
    const std::string note =
        std::to_string(filled) + " of " + std::to_string(all) +
        " photographs state no light strength (pl_intensity); that of all others is taken, " +
        *findings.strengths.begin();
    source.capture.calibration["light_strengths"] = note;
    source.notes.push_back("warning: " + note);
    return;
  }
  source.capture.calibration["light_strengths"] = "unknown, taken as equal";
  source.notes.push_back(
      "light strengths are unknown (no pl_intensity) for all photographs; intensity 1 is written");
}

// Drops validation, or makes it the test; drops unlisted frames.
void settleSplits(Json& frames, const SplitLists& lists, Part ofFile, std::vector<std::string>& notes) {
  std::vector<Part> parts;
  for (size_t f = 0; f < frames.size(); ++f) try {
      parts.push_back(partOf(frames[f], lists, ofFile));
    } catch (Error& e) {
      throw std::move(e).at("frames[" + std::to_string(f) + "]");
    }
  const auto count = [&](Part part) { return std::ranges::count(parts, part); };
  const auto tests = count(Part::test), validations = count(Part::validation), idle = count(Part::none);
  if (validations > 0)
    notes.push_back(std::to_string(validations) + " validation photographs " +
                    (tests > 0 ? "are left out" : "are the test"));
  if (idle > 0) notes.push_back(std::to_string(idle) + " photographs that no split names are left out");
  if (!frames.empty()) lists.check(frames, std::ssize(frames) == idle, count(Part::train) == 0);
  Json kept = Json::array();
  for (size_t f = 0; f < frames.size(); ++f) {
    if (parts[f] == Part::none || (parts[f] == Part::validation && tests > 0)) continue;
    kept.push_back(std::move(frames[f]));
    if (kept.back().is_object() && (!kept.back().contains("split") || kept.back()["split"].is_string()))
      kept.back()["split"] = parts[f] == Part::train ? "train" : "test";
  }
  frames = std::move(kept);
}

capture::Capture describe(const fs::path& file, Part ofFile, bool allowOutside, Findings& findings) try {
  const capture::PathRule paths = allowOutside ? capture::PathRule::anywhere : capture::PathRule::inside;
  const std::string content = readFile(file);
  Json root = Json::parse(capture::shallowPart(content, capture::kDeepestJson), nullptr, false);
  if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array())
    return capture::parseCapture(content, file, paths); // throws the Error

  if (root.contains("applied_transform") || root.contains("applied_scale"))
    findings.notes.push_back("nerfstudio's applied_transform is kept in: poses are as " +
                             file.filename().string() + " says, not as COLMAP did");
  const SplitLists lists(root);
  settleSplits(root["frames"], lists, ofFile, findings.notes);
  settleLamps(root["frames"], findings);
  spellOutIntrinsics(root);
  for (Json& frame : root["frames"]) {
    if (!frame.is_object()) continue;
    spellOutIntrinsics(frame);
    spellOutPath(frame);
  }
  return capture::parseCapture(root.dump(), file, paths);
} catch (Error& e) {
  throw std::move(e).in(file);
}

// ---------------------------------------------------------------------------------------------------------
// Merging of several files.

bool samePlace(const capture::View& a, const capture::View& b) {
  const auto &x = a.camera.cameraFromWorld, &y = b.camera.cameraFromWorld;
  return a.camera.lens == b.camera.lens && x.rotation() == y.rotation() && x.translation() == y.translation();
}

// Returns whether the reader has named the light after its frame.
bool isUnnamed(const capture::Light& light) { return light.name.starts_with("pl_pos["); }

size_t lightIn(std::vector<capture::Light>& lights, capture::Light light, const std::string& file) {
  for (size_t l = 0; l < lights.size(); ++l) {
    const bool sameName = lights[l].name == light.name;
    if (lights[l].kind == light.kind && (sameName || (isUnnamed(lights[l]) && isUnnamed(light)))) return l;
    if (sameName && !isUnnamed(light))
      throw Error("differs from the light of this name in another file").at("light " + light.name);
  }
  if (isUnnamed(light)) light.identity = light.name += " of " + file;
  lights.push_back(std::move(light));
  return lights.size() - 1;
}

template <class Value, class IsSet> void agree(Value& all, const Value& part, const char* key, IsSet isSet) {
  if (isSet(all) && isSet(part) && all != part) throw Error("differs from that of another file").at(key);
  if (isSet(part)) all = part;
}

void append(capture::Capture& all, capture::Capture part, const fs::path& file) {
  agree(all.colorSpace, part.colorSpace, "color_space", [](auto& c) { return bool(c); });
  agree(all.response, part.response, "response", [](auto& r) { return bool(r); });
  agree(all.geometry, part.geometry, "geometry", [](auto& g) { return !g.empty(); });
  agree(all.time, part.time, "time", [](auto& t) { return bool(t); });
  agree(all.origin, part.origin, "origin", [](auto&) { return true; });
  if (all.frames[0].light.has_value() != part.frames[0].light.has_value())
    throw Error("one file has lights, another has none").at("frames[0].light");
  std::vector<size_t> newView, newLight;
  for (capture::View& view : part.views) {
    const auto known =
        std::ranges::find_if(all.views, [&](const capture::View& other) { return samePlace(view, other); });
    newView.push_back(static_cast<size_t>(known - all.views.begin()));
    if (known == all.views.end()) all.views.push_back(std::move(view));
  }
  for (capture::Light& light : part.lights)
    newLight.push_back(lightIn(all.lights, std::move(light), file.stem().string()));
  for (capture::Frame& frame : part.frames) {
    frame.view = newView[frame.view];
    if (frame.light) frame.light = newLight[*frame.light];
    all.frames.push_back(std::move(frame));
  }
  all.calibration.merge(part.calibration);
  for (const std::string& note : part.notes)
    if (std::ranges::find(all.notes, note) == all.notes.end())
      all.notes.push_back(file.filename().string() + ": " + note);
}

std::optional<fs::path> firstFile(const fs::path& folder, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (isFile(folder / name)) return folder / name;
  return std::nullopt;
}

// Notes split files beside transforms.json, which are not read.
void noteSplitFiles(const fs::path& folder, std::vector<std::string>& notes) {
  std::vector<std::string> beside;
  for (const char* name :
       {"transforms_train.json", "transforms_test.json", "transforms_val.json", "transforms_valid.json"})
    if (isFile(folder / name)) beside.push_back(name);
  if (beside.empty()) return;
  std::string names = beside[0];
  for (size_t i = 1; i < beside.size(); ++i) names += (i + 1 < beside.size() ? ", " : " and ") + beside[i];
  notes.push_back("transforms.json is read; " + names + " beside it " + (beside.size() > 1 ? "are" : "is") +
                  " not");
}

} // namespace

std::optional<fs::path> findTransforms(const fs::path& folder) {
  return firstFile(folder, {"transforms.json", "transforms_train.json"});
}

ForeignCapture readTransforms(const fs::path& folderOrFile, bool allowOutside) {
  const bool ofFolder = isFolder(folderOrFile);
  const fs::path file =
      ofFolder ? findTransforms(folderOrFile).value_or(folderOrFile / "transforms.json") : folderOrFile;
  const fs::path folder = file.parent_path();
  ForeignCapture source;
  source.files = {folder, allowOutside};

  Findings findings;
  capture::Capture all = describe(file, Part::train, allowOutside, findings);
  if (ofFolder && file.filename() == "transforms.json") noteSplitFiles(folder, findings.notes);
  if (ofFolder && file.filename() == "transforms_train.json") {
    const auto test = firstFile(folder, {"transforms_test.json"}),
               validation = firstFile(folder, {"transforms_val.json", "transforms_valid.json"});
    for (const auto& [other, part] : {std::pair(test, Part::test), std::pair(validation, Part::validation)})
      if (other && (part == Part::test || !test)) try {
          append(all, describe(*other, part, allowOutside, findings), *other);
        } catch (Error& e) {
          throw std::move(e).in(*other);
        }
    if (test && validation)
      findings.notes.push_back("validation photographs of " + validation->filename().string() +
                               " are left out");
  }
  source.notes = std::move(findings.notes);
  source.notes.insert(source.notes.end(), all.notes.begin(), all.notes.end());
  all.file.clear();
  const auto toPlace = [&](fs::path& path) {
    if (path.empty()) return;
    path = folder / path;
    source.files.check(path); // also links
  };
  toPlace(all.geometry);
  for (capture::Frame& frame : all.frames) {
    toPlace(frame.picture);
    toPlace(frame.mask);
    for (capture::Exposure& exposure : frame.further) toPlace(exposure.picture);
  }
  source.capture = std::move(all);
  sayLamps(findings, source);
  return source;
}

} // namespace surflect::importers
