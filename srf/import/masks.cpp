#include "srf/import/masks.h"

#include "srf/import/text.h"
#include "surfel/base/text.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <span>

namespace surflect::importers {

namespace fs = std::filesystem;

namespace {

// Pictures of folders by name without extension; each folder is listed once.
class Listings {
public:
  const std::vector<fs::path>& of(const fs::path& folder, const std::string& stem) {
    static const std::vector<fs::path> none;
    const auto [known, isNew] = folders_.try_emplace(folder);
    if (isNew && isFolder(folder))
      for (const fs::path& picture : picturesIn(folder)) known->second[picture.stem()].push_back(picture);
    const auto found = known->second.find(stem);
    return found == known->second.end() ? none : found->second;
  }

private:
  std::map<fs::path, std::map<std::string, std::vector<fs::path>>> folders_;
};

// A folder of masks, with a picture's relative name below it.
struct Place {
  fs::path folder, name;
};

// Places to search: the given folders, then masks/ in and beside each folder of pictures below the root.
std::vector<Place> placesFor(const fs::path& picture, const fs::path& root,
                             std::span<const fs::path> folders) {
  fs::path name = picture.lexically_relative(root), folder = root;
  std::vector<Place> places;
  if (name.empty() || *name.begin() == "..") return places;
  for (const fs::path& masks : folders) places.push_back({masks, name});
  while (std::next(name.begin()) != name.end()) {
    const fs::path parent = folder, below = *name.begin();
    folder /= below;
    name = name.lexically_relative(below);
    for (const fs::path& masks : maskFoldersIn(parent, below.string())) places.push_back({masks, name});
    for (const fs::path& masks : maskFoldersIn(folder)) places.push_back({masks, name});
  }
  return places;
}

struct Candidates {
  std::vector<fs::path> masks; // most likely name first
  fs::path bounds;             // folder that links must not leave
};

// Candidates of the first folder that has any, except pictures of frames.
Candidates candidatesFor(const fs::path& picture, std::span<const Place> places,
                         const std::set<fs::path>& inUse, Listings& listings) {
  const std::string file = picture.filename(), stem = picture.stem();
  Candidates found;
  const auto look = [&](const fs::path& folder, const fs::path& bounds, std::span<const std::string> keys) {
    for (const std::string& key : keys)
      for (const fs::path& mask : listings.of(folder, key))
        if (!inUse.contains(mask.lexically_normal())) found.masks.push_back(mask);
    found.bounds = bounds;
    return !found.masks.empty();
  };
  std::vector<std::string> keys;
  for (const std::string& name : {stem, file})
    for (const char* end : {"_mask", "-mask", ".mask"}) keys.push_back(name + end);
  const size_t withSuffix = keys.size();
  for (const std::string& key : {"mask_" + stem, stem, file}) keys.push_back(key);
  std::ranges::reverse(keys);
  for (const auto& [folder, name] : places)
    if (look(folder / name.parent_path(), folder.parent_path(), keys)) return found;
  look(picture.parent_path(), picture.parent_path(), std::span(keys).last(withSuffix));
  return found;
}

// Mask of a view's name in a folder of masks, for photographs that differ in light alone.
std::optional<fs::path> maskOfCamera(const std::string& camera, std::span<const fs::path> folders,
                                     const std::set<fs::path>& inUse, Listings& listings) {
  const fs::path name(camera);
  for (const fs::path& folder : folders)
    for (const fs::path& mask : listings.of(folder / name.parent_path(), name.filename().string()))
      if (!inUse.contains(mask.lexically_normal())) return mask;
  return std::nullopt;
}

// Returns whether a folder's name tells of masks, though masks are not looked up there.
bool soundsLikeMasks(const fs::path& folder) {
  const std::string name = lowerCase(folder.filename().string());
  return std::ranges::any_of(std::array{"mask", "matte", "silhouette", "segment"},
                             [&](const char* word) { return name.find(word) != name.npos; });
}

// Notes, for each folder of photographs, the folder in it or beside it that sounds like masks and holds most
// pictures of the photographs' names.
void noteOtherFolders(ForeignCapture& source, Listings& listings) {
  std::map<fs::path, std::set<fs::path>> photographs; // by folder
  for (const capture::Frame& frame : source.capture.frames)
    photographs[frame.picture.parent_path()].insert(frame.picture);
  for (const auto& [folder, pictures] : photographs) {
    const auto countIn = [&](const fs::path& other) {
      return std::ranges::count_if(pictures, [&](const fs::path& picture) {
        const std::string stem = picture.stem();
        return std::ranges::any_of(
            std::array{stem, picture.filename().string(), stem + "_mask", "mask_" + stem},
            [&](const std::string& key) { return !listings.of(other, key).empty(); });
      });
    };
    fs::path best;
    std::pair<std::ptrdiff_t, bool> most; // pictures of the names; and the name of the folder in its own
    for (const fs::path& place : {folder, folder.has_parent_path() ? folder.parent_path() : fs::path(".")}) {
      std::error_code problem;
      for (fs::directory_iterator entry(place, problem), end; !problem && entry != end;
           entry.increment(problem)) {
        const fs::path& other = entry->path();
        if (!isFolder(other) || !soundsLikeMasks(other)) continue;
        const std::pair found(countIn(other), other.filename().string().find(folder.filename().string()) !=
                                                  std::string::npos);
        if (found.first == 0 || found < most || (found == most && best < other)) continue;
        best = other;
        most = found;
      }
    }
    if (best.empty()) continue;
    source.notes.push_back("warning: " + counted(static_cast<size_t>(most.first), "picture") + " of " +
                           source.files.shown(best) + "/ " + (most.first > 1 ? "have" : "has") +
                           " the names of photographs, but masks are looked up in masks/ alone: if these are "
                           "masks, rename the folder to " +
                           source.files.shown(folder / "masks") + "/");
  }
}

} // namespace

std::vector<fs::path> maskFoldersIn(const fs::path& parent, std::string_view pictures) {
  std::vector<fs::path> folders;
  std::vector<std::string> names{"masks", "mask"};
  if (pictures.starts_with("images_")) names.insert(names.begin(), "masks" + std::string(pictures.substr(6)));
  for (const std::string& name : names)
    if (isFolder(parent / name)) folders.push_back(parent / name);
  return folders;
}

void findMasks(ForeignCapture& source) {
  std::vector<capture::Frame>& frames = source.capture.frames;
  const auto shown = [&](const fs::path& file) { return source.files.shown(file); };
  const bool named =
      std::ranges::any_of(frames, [](const capture::Frame& frame) { return !frame.mask.empty(); });

  Listings listings;
  std::set<fs::path> inUse, searched;
  for (const capture::Frame& frame : frames) {
    if (!frame.mask.empty()) inUse.insert(frame.mask.lexically_normal());
    for (const capture::Exposure& shot : capture::bracketOf(frame))
      inUse.insert(shot.picture.lexically_normal());
  }
  std::map<fs::path, std::vector<size_t>> claims; // frames by the mask found for them
  std::vector<std::string> ambiguous;
  for (size_t f = 0; f < frames.size(); ++f) {
    const fs::path picture = frames[f].picture.lexically_normal();
    const std::vector<Place> places =
        placesFor(picture, source.files.root.lexically_normal(), source.maskFolders);
    for (const Place& place : places) searched.insert(place.folder.lexically_normal());
    if (!frames[f].mask.empty()) continue;
    auto [candidates, bounds] = candidatesFor(picture, places, inUse, listings);
    if (const std::string& camera = source.capture.views[frames[f].view].identity; candidates.empty())
      if (auto mask = maskOfCamera(camera, source.maskFolders, inUse, listings)) {
        bounds = mask->parent_path();
        candidates = {*std::move(mask)};
      }
    if (candidates.empty()) continue;
    SourceFiles{bounds, source.files.allowOutside}.check(candidates[0]);
    claims[candidates[0]].push_back(f);
    if (candidates.size() > 1)
      ambiguous.push_back(shown(candidates[0]) + ", not " + candidates[1].filename().string());
  }

  std::vector<std::string> taken, shared;
  size_t masked = 0;
  for (const auto& [mask, claiming] : claims) {
    const auto isOfOneView = [&](size_t f) { return frames[f].view == frames[claiming[0]].view; };
    if (!std::ranges::all_of(claiming, isOfOneView)) {
      shared.push_back(shown(mask));
      inUse.insert(mask.lexically_normal());
      continue;
    }
    taken.push_back(shown(mask) + " for " + shown(frames[claiming[0]].picture));
    masked += claiming.size();
    inUse.insert(mask.lexically_normal());
    if (named) continue;
    for (const size_t f : claiming) frames[f].mask = mask;
  }

  std::vector<std::string>& notes = source.notes;
  if (named && !taken.empty())
    notes.push_back(
        "masks of " + counted(masked, "photograph") +
        " that the source names no mask for are not used, though their names fit: " + firstNames(taken));
  if (!named && !taken.empty())
    notes.push_back(counted(taken.size(), "mask") + " found by name for " + std::to_string(masked) + " of " +
                    counted(frames.size(), "photograph") + ": " + firstNames(taken));
  if (!named && taken.empty()) noteOtherFolders(source, listings);
  if (!named && !ambiguous.empty())
    notes.push_back("several masks fit " + counted(ambiguous.size(), "photograph") +
                    " by name; taken: " + firstNames(ambiguous));
  if (!shared.empty())
    notes.push_back("masks whose names photographs of several views have, which are not used: " +
                    std::to_string(shared.size()) + " (" + firstNames(shared) + ")");
  std::vector<std::string> idle;
  for (const fs::path& folder : searched)
    for (const fs::path& file : picturesBelow(folder))
      if (!inUse.contains(file.lexically_normal())) idle.push_back(shown(file));
  if (!idle.empty())
    notes.push_back("files among masks that are not used: " + std::to_string(idle.size()) + " (" +
                    firstNames(idle) + ")");
}

} // namespace surflect::importers
