#include "srf/import/copies.h"

#include "srf/capture/mask_file.h"
#include "srf/image/png.h"
#include "surfel/base/file.h"
#include "surfel/base/folder.h"

#include <algorithm>

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

image::Image imageOf(const image::Mask& mask) {
  image::Image image(mask.width, mask.height, 1);
  std::ranges::copy(mask.inside, image.values.begin());
  return image;
}

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

void copyFiles(capture::Capture& capture, const std::vector<image::Mask>& masks, Copies& copies,
               const Progress& progress) {
  std::vector<fs::path> maskOf(capture.views.size());
  for (size_t f = 0; f < capture.frames.size(); ++f) {
    capture::Frame& frame = capture.frames[f];
    progress("copying", static_cast<double>(f) / static_cast<double>(capture.frames.size()));
    if (!masks.empty()) {
      fs::path& mask = maskOf[frame.view];
      if (mask.empty() && !masks[frame.view].inside.empty())
        mask = copies.writePng(frame.picture, "masks", imageOf(masks[frame.view]));
      frame.mask = mask;
    } else if (!frame.mask.empty()) {
      frame.mask = copies.copy(frame.mask, "masks", progress);
    }
    frame.picture = copies.copy(frame.picture, "images", progress);
    for (capture::Exposure& exposure : frame.further)
      exposure.picture = copies.copy(exposure.picture, "images", progress);
  }
  if (!capture.geometry.empty()) capture.geometry = copies.copy(capture.geometry, "geometry", progress);
}

} // namespace surflect::importers
