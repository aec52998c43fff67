#include "apps/film_files.h"

#include "render/scene/scene.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"
#include "surfel/base/text.h"
#include "surfel/base/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace surflect {

namespace {

// All files of a frame, its picture last.
std::vector<std::filesystem::path> frameFiles(const scene::Output& output,
                                              const std::filesystem::path& picture) {
  std::vector<std::filesystem::path> files;
  for (const std::string& map : output.maps) files.push_back(mapPath(picture, map));
  if (output.png) files.push_back(previewPath(picture));
  files.push_back(picture);
  return files;
}

// Whether a name is that of a video of the whole film or of a part: "film.mp4", "film.1-12.mp4".
bool isVideoOf(const std::filesystem::path& video, const std::string& name) {
  const std::string stem = video.stem().string(), extension = video.extension().string();
  if (!name.starts_with(stem) || !name.ends_with(extension) || name.size() < stem.size() + extension.size())
    return false;
  const std::string part = name.substr(stem.size(), name.size() - stem.size() - extension.size());
  return part.empty() || (part.front() == '.' && part.find_first_not_of("0123456789-x", 1) == part.npos);
}

} // namespace

std::vector<int> FilmPlace::frames() const {
  std::vector<int> frames;
  for (int frame = range.first; frame <= range.last; frame += every) frames.push_back(frame);
  return frames;
}

bool FilmPlace::isPart(const scene::Frames& all) const {
  return range.first != all.first || range.last != all.last || (every > 1 && all.count() > 1);
}

std::string filmIdentity(const scene::Script& script, const method::Description& model,
                         const film::ShotRenderer& shot, const film::Finish& finish, double scale) {
  std::string identity =
      fmt::format("surflect {} script {} {} scale {}", kVersion, hex(script.hash), model.identity, scale);
  for (const scene::Environment& environment : shot.environments())
    identity += " environment " + hex(environment.hash);
  return identity + finish.identity();
}

std::filesystem::path previewPath(std::filesystem::path picture) { return picture.replace_extension(".png"); }

std::filesystem::path mapPath(std::filesystem::path picture, const std::string& map) {
  return picture.replace_extension('.' + map + ".png");
}

std::filesystem::path videoPath(const scene::Output& output, const scene::Frames& all,
                                const FilmPlace& place) {
  std::filesystem::path path = place.folder / output.video;
  if (!place.isPart(all)) return path;
  const std::string every = place.every > 1 ? fmt::format("x{}", place.every) : "";
  return path.replace_extension(
      fmt::format(".{}-{}{}{}", place.range.first, place.range.last, every, path.extension().string()));
}

bool isRendered(const std::filesystem::path& path, const scene::Output& output, const std::string& identity,
                bool anySetting) {
  if (!std::filesystem::exists(path)) return false;
  try {
    const image::ExrFile file(path);
    const auto found = file.attribute("surflect.identity");
    if (found != identity && !(anySetting && found && found->starts_with(identity))) return false;
    std::vector<image::ChannelSet> all;
    for (const std::string& channel : file.channels()) all.push_back({channel});
    file.read(all);
    std::vector<std::filesystem::path> others = frameFiles(output, path);
    others.pop_back();
    return std::ranges::all_of(others, [&](const std::filesystem::path& other) {
      const image::Image image = image::readPng(other).image;
      return image.width == file.width() && image.height == file.height();
    });
  } catch (const Error&) {
    return false;
  }
}

std::set<std::filesystem::path> writableFolders(const scene::Output& output, const FilmPlace& place,
                                                const std::filesystem::path& video) {
  std::set<std::filesystem::path> folders;
  for (const int frame : place.frames()) {
    const auto path = scene::framePath(output, place.folder, frame);
    folders.insert(path.parent_path());
    for (const auto& file : frameFiles(output, path)) requireReplaceable(file);
  }
  if (!video.empty()) {
    folders.insert(video.parent_path());
    requireReplaceable(video);
  }
  for (const auto& folder : folders) requireCreatable(folder);
  return folders;
}

void removeLitter(const scene::Script& script, const std::filesystem::path& folder) {
  std::map<std::filesystem::path, std::set<std::string>> targets; // by folder
  for (int frame = script.frames->first; frame <= script.frames->last; ++frame) {
    const auto path = scene::framePath(*script.output, folder, frame);
    std::set<std::string>& names = targets[path.parent_path()];
    names.insert(path.filename().string());
    names.insert(previewPath(path).filename().string());
    for (const std::string_view map : scene::mapNames)
      names.insert(mapPath(path, std::string(map)).filename().string());
  }
  for (const auto& [place, names] : targets)
    removeAbandoned(place, [&](const std::string& target) { return names.contains(target); });
  if (script.output->video.empty()) return;
  const auto video = folder / script.output->video;
  removeAbandoned(video.parent_path(), [&](const std::string& target) { return isVideoOf(video, target); });
}

} // namespace surflect
