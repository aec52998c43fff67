// Output folder that appears complete or not at all.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace surflect::importers {

// Files of a source, copied into the folder of the imported capture.

// Copies files into a folder, each once, and keeps their relative paths if possible. Places are the folder's
// images/, masks/ and geometry/.
class Copies {
public:
  Copies(std::filesystem::path root, std::filesystem::path output)
      : root_(std::move(root)), output_(std::move(output)) {}

  // Copies a file once; returns its path in the folder.
  std::filesystem::path copy(const std::filesystem::path& source, const char* place,
                             const Progress& progress);
  // Writes a picture as PNG under the name of a source file; returns its path in the folder.
  std::filesystem::path writePng(const std::filesystem::path& source, const char* place,
                                 const image::Image& image);
  // Writes a picture as PNG in place of a source file; returns an absolute path, which copy() takes.
  std::filesystem::path replace(const std::filesystem::path& source, const char* place,
                                const image::Image& image);

  size_t files(const char* place) const;
  uint64_t bytes() const { return bytes_; }

private:
  // Unique path below a place.
  std::filesystem::path claim(const std::filesystem::path& source, const char* place);
  void count(const std::filesystem::path& written);

  std::filesystem::path root_, output_;
  std::map<std::pair<std::filesystem::path, std::string>, std::filesystem::path> copied_;
  std::set<std::filesystem::path> taken_;
  uint64_t bytes_ = 0;
};

// Writes inverted copies of the source's masks, which replace them in the capture.
void invertMasks(capture::Capture& capture, Copies& copies, const Progress& progress);

// Writes copies of the photographs with colours that are divided by alpha, which replace them in the capture.
// Throws Error for a picture that is not a PNG of 8 bits in sRGB.
void divideByAlpha(capture::Capture& capture, Copies& copies, const Progress& progress);

// Copies all files, and changes the capture's paths to those of the copies.
void copyFiles(capture::Capture& capture, Copies& copies, const Progress& progress);

// Earlier output that a new one may replace: a folder that holds the file `mark`, and at its top only names
// that `isWritten` knows.
struct EarlierOutput {
  std::filesystem::path mark; // none: nothing is replaced
  std::function<bool(std::string_view name)> isWritten;
};

// Filled beside the target, in a folder TARGET.tmp.XXXXXX, and renamed by commit(); otherwise removed by the
// destructor. First removes what a killed process has left for the same target. The target must not exist, be
// an empty folder, or earlier output, which is replaced whole. A target that is a link is what it leads to.
// Throws Error, commit() too.
class OutputFolder {
public:
  explicit OutputFolder(std::filesystem::path target, EarlierOutput earlier = {});
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  const std::filesystem::path& temporaryPath() const { return temporary_; }
  void commit();

private:
  // Throws Error naming what the earlier output did not write.
  void requireWritten() const;

  std::filesystem::path target_, temporary_;
  EarlierOutput earlier_;
  int descriptor_ = -1;   // of the temporary folder; locked during the object's lifetime
  bool replaces_ = false; // the target holds the mark
  bool committed_ = false;
};

} // namespace surflect::importers
