#include "srf/model/pack_source.h"

#include "srf/capture/photograph.h"
#include "surfel/base/file.h"
#include "surfel/base/time.h"

#include <fmt/format.h>

#include <cassert>
#include <set>
#include <utility>

namespace surflect::model {

CaptureSource::CaptureSource(const capture::Capture& capture)
    : training_(capture::subset(
          capture, [](const capture::Frame& frame) { return frame.split == capture::Split::train; })) {}

proxy::Impostor CaptureSource::impostor(const proxy::ImpostorOptions& options,
                                        const Progress& progress) const {
  return proxy::impostorOf(training_, options, progress);
}

std::string CaptureSource::identity() const {
  std::set<std::filesystem::path> pictures;
  for (const capture::Frame& frame : training_.frames) {
    for (const capture::Exposure& shot : capture::bracketOf(frame)) pictures.insert(shot.picture);
    if (!frame.mask.empty()) pictures.insert(frame.mask);
  }
  std::string description = readFile(training_.file);
  for (const auto& picture : pictures) {
    const auto path = training_.folder() / picture;
    description += fmt::format("{} {} {}\n", picture.string(), std::filesystem::file_size(path),
                               std::filesystem::last_write_time(path).time_since_epoch().count());
  }
  return fmt::format("capture {:016x}", contentHash(description));
}

namespace {

ViewPictures picturesOf(capture::ViewPhotographs photographs) {
  const int width = photographs.alpha.width, height = photographs.alpha.height;
  return {{width, height, std::move(photographs.radiance), std::move(photographs.alpha)},
          photographs.hasMatte,
          photographs.invalidTexels};
}

} // namespace

ViewPictures readViewPictures(const capture::Capture& capture, std::span<const size_t> frames,
                              const Progress& progress) {
  assert(!frames.empty());
  return picturesOf(capture::readViewPhotographs(capture, frames, progress));
}

ViewPictures readPicturePart(const capture::Capture& capture, std::span<const size_t> frames,
                             const capture::ViewPart& part, const Progress& progress) {
  assert(!frames.empty());
  return picturesOf(capture::readViewPart(capture, frames, part, progress));
}

ViewPictures CaptureSource::pictures(std::span<const size_t> frames, bool, const Progress& progress) {
  return readViewPictures(training_, frames, progress);
}

double CaptureSource::secondsPerPicture(const Progress& progress) const {
  constexpr size_t kFiles = 4; // from one view, all frames that are in them
  const size_t view = training_.frames[training_.frames.size() / 2].view;
  std::set<std::filesystem::path> files;
  std::vector<size_t> frames;
  for (size_t i = 0; i < training_.frames.size(); ++i) {
    const capture::Frame& frame = training_.frames[i];
    if (frame.view != view || (files.size() == kFiles && !files.contains(frame.picture))) continue;
    files.insert(frame.picture);
    frames.push_back(i);
  }
  const Stopwatch watch;
  readViewPictures(training_, frames, progress);
  return watch.seconds() / static_cast<double>(frames.size());
}

} // namespace surflect::model
