// Files of a film: their names, and which of them are there.
#pragma once

#include "apps/frame_range.h"
#include "render/film/display.h"
#include "render/film/shot_renderer.h"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace surflect {

// Frames of a film in a folder.
struct FilmPlace {
  std::filesystem::path folder;
  FrameRange range;
  int every = 1; // renders every N-th frame of the range

  std::vector<int> frames() const;
  // Whether these are not all frames of the script.
  bool isPart(const scene::Frames& all) const;
};

// Text that holds everything that determines a film's pixels.
std::string filmIdentity(const scene::Script& script, const method::Description& model,
                         const film::ShotRenderer& shot, const film::Finish& finish, double scale);

std::filesystem::path previewPath(std::filesystem::path picture);
// "frame.0001.normal.png" beside "frame.0001.exr"
std::filesystem::path mapPath(std::filesystem::path picture, const std::string& map);
// "film.mp4"; "film.1-12.mp4" of a part, "film.1-96x8.mp4" of every eighth frame, so that neither takes the
// whole film's place. The output must have a video.
std::filesystem::path videoPath(const scene::Output& output, const scene::Frames& all,
                                const FilmPlace& place);

// Whether a whole frame is there that was rendered so, with its preview and maps if they are asked for. Reads
// all pixels, since a file may have been cut short after its header. Under a budget of time any setting will
// do: the frame's identity begins with `identity` and ends with it.
bool isRendered(const std::filesystem::path& path, const scene::Output& output, const std::string& identity,
                bool anySetting);

// Folders of the frames, and of the video if `video` is not empty. Throws Error if a file cannot be written:
// its folder cannot be created or written to, or its name is taken by something other than a file.
std::set<std::filesystem::path> writableFolders(const scene::Output& output, const FilmPlace& place,
                                                const std::filesystem::path& video);

// Removes temporaries of the script's frames, of their maps of any kind and of its videos, left by a killed
// run.
void removeLitter(const scene::Script& script, const std::filesystem::path& folder);

} // namespace surflect
