#include "apps/viewer/photographs.h"

#include "render/film/frame_file.h"
#include "srf/capture/photograph.h"
#include "srf/proxy/impostor.h"
#include "surfel/base/error.h"

#include <algorithm>

namespace surflect::viewer {

namespace {

constexpr size_t kKeptBytes = size_t{256} << 20; // of photographs in memory

std::string lightOf(const capture::Capture& capture, const capture::Frame& frame) {
  return frame.light ? capture.lights[*frame.light].identity : "";
}

// Frame of the names; empty if there is none.
std::optional<size_t> frameOf(const capture::Capture& capture, const std::string& camera,
                              const std::string& light) {
  std::optional<size_t> found;
  for (size_t i = 0; i < capture.frames.size(); ++i) {
    const capture::Frame& frame = capture.frames[i];
    if (capture.views[frame.view].identity != camera || lightOf(capture, frame) != light) continue;
    if (!found || frame.split == capture::Split::test) found = i;
  }
  return found;
}

} // namespace

Photographs::Photographs(capture::Capture capture, const capture::Capture* rig)
    : capture_(std::move(capture)), rig_(rig), atRest_(warp::chainWarp({})) {}

size_t Photographs::find(const std::string& camera, const std::string& light) const {
  if (const auto found = frameOf(capture_, camera, light)) return *found;
  const bool hasCamera =
      std::ranges::any_of(capture_.views, [&](const capture::View& view) { return view.identity == camera; });
  if (!hasCamera) throw Error::mismatch("a camera of the capture", '"' + camera + '"').at("camera");
  throw Error::mismatch("a light of this camera's photographs", '"' + light + '"').at("light");
}

std::shared_ptr<const image::Image> Photographs::read(size_t frame, const Progress& progress) {
  const std::lock_guard lock(mutex_);
  const auto kept = std::ranges::find(kept_, frame, [](const auto& each) { return each.first; });
  if (kept != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, kept);
    return kept->second;
  }
  const std::vector<capture::Photograph> read =
      capture::readPhotographs(capture_, std::span(&frame, 1), progress);
  auto picture = std::make_shared<const image::Image>(image::overBlack(read[0].radiance, read[0].alpha));
  kept_.emplace_front(frame, picture);
  size_t bytes = 0;
  const auto first = std::ranges::find_if(kept_, [&](const auto& each) {
    bytes += each.second->values.size() * sizeof(float);
    return bytes > kKeptBytes;
  });
  kept_.erase(first, kept_.end());
  return picture;
}

double Photographs::whiteOf(size_t frame, const Progress& progress) {
  const double white = film::whiteOf(*read(frame, progress));
  return white > 0 ? white : 1;
}

Photographs::Truth Photographs::truth(size_t frame, const Progress& progress) {
  const capture::Frame& wanted = capture_.frames[frame];
  const std::lock_guard lock(mutex_);
  std::unique_ptr<evaluation::TrueFrames>& truths = truths_[wanted.split == capture::Split::test];
  if (!truths)
    truths = std::make_unique<evaluation::TrueFrames>(capture_, rig_ ? *rig_ : capture_, *atRest_,
                                                      wanted.split, progress);
  const auto found =
      frameOf(truths->capture(), capture_.views[wanted.view].identity, lightOf(capture_, wanted));
  if (!found) throw Error("the object's pixels are not known in this photograph").in(capture_.file);
  scene::Scene shown = truths->sceneOf(*found);
  return {truths->read(std::span(&*found, 1), progress).front(), shown.camera, std::move(shown.lights),
          truths->exposure()};
}

image::Image Photographs::outlined(size_t frame, image::PictureSize size, double exposure,
                                   const Progress& progress) {
  if (capture_.geometry.empty()) throw Error("the capture has no mesh").in(capture_.file);
  const std::lock_guard lock(mutex_);
  if (!surface_) {
    const capture::Capture training = capture::subset(
        capture_, [](const capture::Frame& each) { return each.split == capture::Split::train; });
    surface_ = std::make_unique<evaluation::WhiteSurface>(proxy::impostorOf(training, {}, progress).mesh);
  }
  return evaluation::outlinedPhotograph(capture_, frame, *surface_, size, exposure, progress);
}

} // namespace surflect::viewer
