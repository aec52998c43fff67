#include "srf/import/notes.h"

#include "srf/capture/mask_survey.h"
#include "srf/import/listing.h"
#include "surfel/base/error.h"
#include "surfel/base/first_names.h"

#include <algorithm>
#include <iterator>
#include <set>

namespace surflect::importers {

namespace fs = std::filesystem;

void noteTurned(const std::map<fs::path, int>& orientations, ForeignCapture& source) {
  size_t turned = 0;
  std::set<int> different;
  for (const auto& [picture, orientation] : orientations)
    if (orientation != 1) ++turned, different.insert(orientation);
  if (turned == 0) return;
  std::string values;
  for (const int value : different) values += (values.empty() ? "" : ", ") + std::to_string(value);
  source.notes.push_back(
      std::to_string(turned) + " of " + std::to_string(orientations.size()) +
      " photographs carry an EXIF orientation (" + values +
      ") and are taken as they are stored, not turned; poses and light directions must be those "
      "of the stored pictures");
}

void noteUnused(ForeignCapture& source, bool below) {
  std::set<fs::path> folders, used;
  for (const capture::Frame& frame : source.capture.frames) {
    used.insert(frame.mask.lexically_normal());
    for (const capture::Exposure& shot : capture::bracketOf(frame)) {
      used.insert(shot.picture.lexically_normal());
      folders.insert(shot.picture.parent_path());
    }
  }
  std::vector<fs::path> there;
  if (below) there = picturesBelow(source.files.root);
  for (const fs::path& folder : below ? std::set<fs::path>() : folders)
    std::ranges::copy(picturesIn(folder.empty() ? "." : folder), std::back_inserter(there));
  std::vector<std::string> unused;
  for (const fs::path& picture : there) {
    const std::string name = source.files.shown(picture);
    const bool isInMasks = std::ranges::any_of(fs::path(name).parent_path(), [](const fs::path& part) {
      return part == "masks" || part == "mask"; // reported by findMasks
    });
    if (!isInMasks && !used.contains(picture.lexically_normal())) unused.push_back(name);
  }
  if (!unused.empty())
    source.notes.push_back("pictures beside the photographs that are not used: " +
                           std::to_string(unused.size()) + " (" + firstNames(unused) + ")");
}

void noteMasks(ForeignCapture& source, bool inverted, const Progress& progress) {
  const bool anyMask =
      std::ranges::any_of(source.capture.frames, [](const capture::Frame& f) { return !f.mask.empty(); });
  if (inverted && !anyMask) throw Error("the source has no masks").at("--invert-masks").in(source.files.root);
  const auto [warnings, notes] = capture::surveyMasks(source.capture, inverted, progress);
  for (const std::string& warning : warnings) source.notes.push_back("warning: " + warning); // as inspect
  source.notes.insert(source.notes.end(), notes.begin(), notes.end());
  if (inverted) source.notes.push_back("masks were inverted: black is the object");
}

} // namespace surflect::importers
