#include "srf/proxy/hull/mattes.h"

#include "srf/capture/matte_vote.h"
#include "srf/capture/photograph.h"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

namespace surflect::hull {

namespace {

// Frames of a view, one per distinct matte.
std::vector<std::vector<size_t>> framesByMatte(const capture::Capture& capture) {
  std::vector<std::vector<size_t>> frames(capture.views.size());
  std::set<std::tuple<size_t, std::string, std::string, std::string>> known;
  for (size_t i = 0; i < capture.frames.size(); ++i) {
    const capture::Frame& frame = capture.frames[i];
    const std::string& layer = frame.alphaLayer.empty() ? frame.layer : frame.alphaLayer;
    if (known.emplace(frame.view, frame.picture.string(), layer, frame.mask.string()).second)
      frames[frame.view].push_back(i);
  }
  return frames;
}

// Returns whether a matte has background; many pictures have an opaque alpha channel.
bool showsBackground(const image::Image& matte) {
  return std::ranges::any_of(matte.values, [](float alpha) { return !(alpha > 0.5f); });
}

std::optional<image::Image> matteOf(const capture::Capture& capture, std::span<const size_t> frames) {
  capture::MatteVote vote(frames.size());
  for (const size_t frame : frames) {
    const capture::Photograph photograph =
        std::move(capture::readPhotographs(capture, std::span(&frame, 1))[0]);
    if (photograph.hasMatte) vote.add(photograph.alpha);
  }
  image::Image matte = vote.outcome();
  return matte.values.empty() ? std::nullopt : std::optional(std::move(matte));
}

// 1 at and beside pixels with alpha that counts (settledAlpha).
image::Image touched(const image::Image& matte) {
  image::Image mask(matte.width, matte.height, 1);
  for (int y = 0; y < matte.height; ++y)
    for (int x = 0; x < matte.width; ++x) {
      if (!(capture::settledAlpha(matte.at(x, y)[0]) > 0)) continue;
      for (int j = std::max(0, y - 1); j <= std::min(matte.height - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(matte.width - 1, x + 1); ++i) mask.at(i, j)[0] = 1;
    }
  return mask;
}

} // namespace

std::vector<SilhouetteView> silhouetteViewsOf(const capture::Capture& capture, const Progress& progress,
                                              Silhouette silhouette) {
  const auto frames = framesByMatte(capture);
  std::vector<SilhouetteView> silhouetteViews;
  for (size_t view = 0; view < frames.size(); ++view) {
    progress("silhouettes", static_cast<double>(view) / static_cast<double>(frames.size()));
    auto matte = matteOf(capture, frames[view]);
    if (matte && silhouette == Silhouette::touched) matte = touched(*matte);
    if (matte && showsBackground(*matte))
      silhouetteViews.push_back({capture.views[view].identity, capture.views[view].camera, Outline(*matte)});
  }
  return silhouetteViews;
}

} // namespace surflect::hull
