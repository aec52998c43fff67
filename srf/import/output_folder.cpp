#include "srf/import/output_folder.h"

#include "srf/capture/mask_file.h"
#include "srf/image/image_file.h"
#include "srf/image/png.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <string>
#include <string_view>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <vector>

namespace surflect::importers {

namespace fs = std::filesystem;

fs::path Copies::claim(const fs::path& source, const char* place) {
  fs::path inner = source.lexically_normal().lexically_relative(root_.lexically_normal());
  if (root_.empty()) inner = source.lexically_normal();
  if (inner.empty() || inner.is_absolute() || *inner.begin() == "..") inner = source.filename();
  if (*inner.begin() == place && std::next(inner.begin()) != inner.end())
    inner = inner.lexically_relative(place);
  fs::path path = fs::path(place) / inner;
  for (int copy = 2; !taken_.insert(path).second; ++copy)
    path = fs::path(place) / inner.parent_path() /
           (inner.stem().string() + "-" + std::to_string(copy) + inner.extension().string());
  createFolder((output_ / path).parent_path());
  return path;
}

fs::path Copies::copy(const fs::path& source, const char* place, const Progress& progress) {
  const auto [known, isNew] = copied_.try_emplace({source, place});
  if (isNew) {
    known->second = claim(source, place);
    copyFile(source, output_ / known->second, progress);
    count(known->second);
  }
  return known->second;
}

fs::path Copies::writePng(const fs::path& source, const char* place, const image::Image& image) {
  const fs::path path = claim(fs::path(source).replace_extension(".png"), place);
  image::writePng(output_ / path, image);
  count(path);
  return path;
}

fs::path Copies::replace(const fs::path& source, const char* place, const image::Image& image) {
  const fs::path path = writePng(source, place, image);
  copied_[{output_ / path, place}] = path;
  return output_ / path;
}

size_t Copies::files(const char* place) const {
  return static_cast<size_t>(
      std::ranges::count_if(taken_, [&](const fs::path& path) { return *path.begin() == place; }));
}

void Copies::count(const fs::path& written) { bytes_ += fs::file_size(output_ / written); }

namespace {

image::Image inverted(image::Image coverage) {
  for (float& value : coverage.values) value = 1 - value;
  return coverage;
}

} // namespace

void invertMasks(capture::Capture& capture, Copies& copies, const Progress& progress) {
  std::map<fs::path, fs::path> written;
  for (capture::Frame& frame : capture.frames) {
    if (frame.mask.empty()) continue;
    progress.checkpoint();
    const auto [known, isNew] = written.try_emplace(frame.mask);
    if (isNew)
      known->second = copies.replace(frame.mask, "masks", inverted(capture::readMask(frame.mask).coverage));
    frame.mask = known->second;
  }
}

void divideByAlpha(capture::Capture& capture, Copies& copies, const Progress& progress) {
  std::map<fs::path, fs::path> written;
  const auto divide = [&](fs::path& path) {
    progress.checkpoint();
    const auto [known, isNew] = written.try_emplace(path, path);
    if (isNew) {
      image::Picture picture = image::readPicture(path);
      const bool isSrgb = !picture.color || picture.color->source == "PNG sRGB chunk";
      if (image::formatOf(path) != image::PictureFormat::png || picture.bits != 8 || !isSrgb)
        throw Error::mismatch("a PNG of 8 bits in sRGB, whose colours can be divided by alpha",
                              "another picture")
            .in(path);
      if (!picture.hasAlpha()) return;
      image::Image& image = picture.image;
      const auto channels = static_cast<size_t>(image.channels);
      for (size_t i = 0; i < image.values.size(); i += channels)
        if (const float alpha = image.values[i + channels - 1]; alpha > 0)
          for (size_t c = 0; c + 1 < channels; ++c)
            image.values[i + c] = std::min(1.f, image.values[i + c] / alpha);
      known->second = copies.replace(path, "images", image);
    }
    path = known->second;
  };
  for (capture::Frame& frame : capture.frames) {
    divide(frame.picture);
    for (capture::Exposure& exposure : frame.further) divide(exposure.picture);
  }
}

void copyFiles(capture::Capture& capture, Copies& copies, const Progress& progress) {
  for (size_t f = 0; f < capture.frames.size(); ++f) {
    capture::Frame& frame = capture.frames[f];
    progress("copying", static_cast<double>(f) / static_cast<double>(capture.frames.size()));
    if (!frame.mask.empty()) frame.mask = copies.copy(frame.mask, "masks", progress);
    frame.picture = copies.copy(frame.picture, "images", progress);
    for (capture::Exposure& exposure : frame.further)
      exposure.picture = copies.copy(exposure.picture, "images", progress);
  }
  if (!capture.geometry.empty()) capture.geometry = copies.copy(capture.geometry, "geometry", progress);
}

namespace fs = std::filesystem;

namespace {

// Mode bit that marks our temporaries: a non-empty folder without it is never removed, whatever its name. A
// mode bit can be cleared after renaming; a marker file would have to be removed before, leaving a moment
// without mark.
constexpr mode_t kMark = S_ISVTX;
constexpr const char* kTemporary = ".tmp.";
constexpr std::string_view kRandom = "XXXXXX";

Error systemError(const fs::path& path, const std::string& action) {
  return Error("cannot " + action + " (" + std::strerror(errno) + ")").in(path);
}

int openFolder(const fs::path& path) {
  return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
}

// Removes a temporary unless a living process holds it or it is not ours. A process killed before it could
// set the mark has left it empty.
void removeIfAbandoned(const fs::path& temporary) {
  const int descriptor = openFolder(temporary);
  if (descriptor < 0) return;
  struct stat status {};
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && ::rmdir(temporary.c_str()) != 0 &&
      ::fstat(descriptor, &status) == 0 && (status.st_mode & kMark) != 0) {
    std::error_code ignored; // nothing to report if it fails
    fs::remove_all(temporary, ignored);
  }
  ::close(descriptor);
}

void removeAbandonedOf(const fs::path& target) {
  std::error_code failure;
  std::vector<fs::path> found;
  const std::string begin = target.filename().string() + kTemporary;
  const fs::path folder = target.has_parent_path() ? target.parent_path() : ".";
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end; entry.increment(failure))
    if (const std::string name = entry->path().filename().string();
        name.starts_with(begin) && name.size() == begin.size() + kRandom.size())
      found.push_back(entry->path());
  for (const fs::path& temporary : found) removeIfAbandoned(temporary);
}

} // namespace

OutputFolder::OutputFolder(fs::path target, EarlierOutput earlier)
    : target_(std::move(target)), earlier_(std::move(earlier)) {
  if (!target_.has_filename()) target_ = target_.parent_path(); // "capture/"
  std::error_code problem;
  if (fs::is_symlink(target_, problem)) { // renaming would replace the link
    const fs::path real = fs::canonical(target_, problem);
    if (problem) throw Error::mismatch("a folder", "a link to nothing").in(target_);
    target_ = real;
  }
  replaces_ = !earlier_.mark.empty() && fs::is_regular_file(target_ / earlier_.mark, problem);
  if (replaces_) requireWritten();
  if (fs::exists(target_, problem) && !replaces_ &&
      !(fs::is_directory(target_, problem) && fs::is_empty(target_, problem)))
    throw Error::mismatch("a new folder, or an empty one", "something there already").in(target_);
  if (target_.has_parent_path()) fs::create_directories(target_.parent_path(), problem);
  removeAbandonedOf(target_);
  for (;;) {
    std::string name = target_.string() + kTemporary + std::string(kRandom);
    if (!::mkdtemp(name.data())) throw systemError(target_, "write");
    temporary_ = name;
    descriptor_ = openFolder(temporary_);
    if (descriptor_ < 0 && errno == ENOENT) continue; // removed as abandoned before it was locked
    if (descriptor_ < 0) throw systemError(target_, "write");
    ::flock(descriptor_, LOCK_EX); // without file locks, no temporary counts as abandoned
    const bool isMarked = ::fchmod(descriptor_, 0700 | kMark) == 0;
    if (isMarked && fs::exists(temporary_, problem)) return;
    const int reason = errno;
    ::close(descriptor_);
    if (isMarked) continue; // removed as abandoned before it was locked
    ::rmdir(temporary_.c_str());
    errno = reason;
    throw systemError(target_, "write");
  }
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  if (!committed_) fs::remove_all(temporary_, ignored);
  ::close(descriptor_);
}

void OutputFolder::requireWritten() const {
  std::error_code failure;
  for (fs::directory_iterator entry(target_, failure), end; !failure && entry != end;
       entry.increment(failure))
    if (const fs::path name = entry->path().filename(); !earlier_.isWritten(name.string()))
      throw Error("is not of the earlier output, which is replaced whole: move it out of the folder")
          .in(target_ / name);
  if (failure) throw Error("cannot read (" + failure.message() + ")").in(target_);
}

void OutputFolder::commit() {
  if (replaces_) requireWritten(); // hours may have passed
  const char* const from = temporary_.c_str();
  const char* const to = target_.c_str();
  if ((replaces_ ? ::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_EXCHANGE) : ::rename(from, to)) != 0)
    throw systemError(target_, "rename to");
  committed_ = true;
  ::fchmod(descriptor_, 0755);
  if (replaces_) { // the old folder now has the temporary's name
    ::chmod(temporary_.c_str(), 0700 | kMark);
    std::error_code ignored;
    fs::remove_all(temporary_, ignored);
  }
}

} // namespace surflect::importers
