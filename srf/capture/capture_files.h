// Files that a capture names, which must be in its own folder unless the user allows others.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image_file.h"

#include <filesystem>
#include <map>
#include <set>
#include <utility>

namespace surflect::capture {

// Paths are relative to the folder and lexically normal. Files that were found are remembered, because many
// frames may share one.
class CaptureFiles {
public:
  CaptureFiles(std::filesystem::path folder, PathRule rule) : folder_(std::move(folder)), rule_(rule) {}

  // Returns whether the rule allows the path: it stays inside the folder (links are not followed), or may lie
  // anywhere.
  bool mayName(const std::filesystem::path& path) const;
  // Returns whether the path is a regular file, or need not exist yet. Throws Error if a link leads out of
  // the folder.
  bool isThere(const std::filesystem::path& path);
  image::PictureSize sizeOf(const std::filesystem::path& picture);

  // Suffix of messages about a path that leaves the folder.
  static constexpr const char* hint = " (--allow-outside lifts this)";

private:
  bool isFileInside(const std::filesystem::path& path) const;

  std::filesystem::path folder_;
  PathRule rule_;
  std::set<std::filesystem::path> found_;
  std::map<std::filesystem::path, image::PictureSize> sizes_;
};

} // namespace surflect::capture
