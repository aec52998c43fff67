#include "srf/capture/capture_files.h"

#include "surfel/base/error.h"

namespace surflect::capture {

namespace fs = std::filesystem;

namespace {

bool leaves(const fs::path& path) { return path.is_absolute() || *path.begin() == ".."; }

} // namespace

bool CaptureFiles::mayName(const fs::path& path) const {
  return rule_ == PathRule::anywhere || !leaves(path);
}

bool CaptureFiles::isThere(const fs::path& path) {
  if (rule_ == PathRule::unmade || found_.contains(path)) return true;
  const bool isFile = isFileInside(path);
  if (isFile) found_.insert(path);
  return isFile;
}

bool CaptureFiles::isFileInside(const fs::path& path) const {
  std::error_code failure; // an inaccessible file counts as missing
  const fs::path full = folder_ / path;
  if (!fs::is_regular_file(full, failure)) return false;
  if (rule_ == PathRule::anywhere) return true;
  const fs::path folder = folder_.empty() ? fs::path(".") : folder_;
  const fs::path place = fs::canonical(full, failure).lexically_relative(fs::canonical(folder, failure));
  if (failure || place.empty() || leaves(place))
    throw Error::mismatch(std::string("a path inside the capture's folder") + hint,
                          "a link that leads out of it: " + path.string());
  return true;
}

image::PictureSize CaptureFiles::sizeOf(const fs::path& picture) {
  const auto [known, isNew] = sizes_.try_emplace(picture);
  if (isNew) known->second = image::readPictureSize(folder_ / picture);
  return known->second;
}

} // namespace surflect::capture
