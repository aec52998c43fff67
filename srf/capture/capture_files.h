// The files that a capture names: those of its own folder, unless its user allows others.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image_file.h"

#include <filesystem>
#include <map>
#include <set>
#include <utility>

namespace surflect::capture {

// Paths are relative to the folder and lexically normal. What was found, which many frames may share, is not
// looked for again.
class CaptureFiles {
public:
  CaptureFiles(std::filesystem::path folder, PathRule rule) : folder_(std::move(folder)), rule_(rule) {}

  // Without following links: does the path stay inside, or may it leave?
  bool mayName(const std::filesystem::path& path) const;
  // Is it a regular file, or need it not be one yet? Throws Error where a link leads out of the folder.
  bool isThere(const std::filesystem::path& path);
  image::PictureSize sizeOf(const std::filesystem::path& picture);

  // What to add to a message about a path that leaves the folder.
  static constexpr const char* hint = " (--allow-outside lifts this)";

private:
  bool isFileInside(const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  PathRule rule_;
  std::set<std::filesystem::path> found_;
  std::map<std::filesystem::path, image::PictureSize> sizes_;
};

} // namespace surflect::capture
