#include "srf/checks/small_view.h"

#include "srf/capture/photograph.h"

#include <algorithm>

namespace surflect {

namespace {

constexpr int kSide = 512; // pixels

// The range of large pixels that small pixel i of `count` stands for.
std::pair<int, int> coveredBy(int i, int count, int all) {
  const int first = static_cast<int>(static_cast<int64_t>(i) * all / count);
  return {first, std::max(first + 1, static_cast<int>(static_cast<int64_t>(i + 1) * all / count))};
}

Image shrunkTo(const Image& image, int width, int height) {
  Image small(width, height, image.channels);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto [top, bottom] = coveredBy(y, height, image.height);
      const auto [left, right] = coveredBy(x, width, image.width);
      const float weight = 1.f / static_cast<float>((bottom - top) * (right - left));
      for (int row = top; row < bottom; ++row)
        for (int column = left; column < right; ++column)
          for (int channel = 0; channel < image.channels; ++channel)
            small.at(x, y)[channel] += weight * image.at(column, row)[channel];
    }
  return small;
}

SmallView smallView(const Capture& capture, size_t frame, const RayCaster<AcquisitionSpace>& mesh) {
  const size_t number = capture.frames[frame].view;
  const Lens& lens = capture.views[number].camera.lens;
  const int step = (std::max(lens.width, lens.height) + kSide - 1) / kSide;
  const int width = std::max(1, lens.width / step), height = std::max(1, lens.height / step);
  SmallView view{number, frame, capture.views[number].camera, {}, {}, {}};
  view.camera.lens = resized(lens, width, height);
  const Photograph photograph = readPhotographs(capture, std::span(&frame, 1))[0];
  view.radiance = shrunkTo(photograph.radiance, width, height);
  if (photograph.hasMatte) view.matte = objectMask(shrunkTo(photograph.alpha, width, height));
  view.outline = objectMask(silhouette(view.camera, mesh));
  return view;
}

} // namespace

std::vector<SmallView> smallViews(const Capture& capture, const RayCaster<AcquisitionSpace>& mesh,
                                  size_t most, const Progress& progress) {
  std::vector<std::optional<size_t>> firstFrame(capture.views.size());
  for (size_t i = capture.frames.size(); i-- > 0;) firstFrame[capture.frames[i].view] = i;
  std::vector<size_t> frames;
  for (const auto& frame : firstFrame)
    if (frame) frames.push_back(*frame);
  std::vector<SmallView> views;
  const size_t count = std::min(most, frames.size());
  for (size_t i = 0; i < count; ++i) {
    progress("photographs", static_cast<double>(i) / static_cast<double>(count));
    views.push_back(smallView(capture, frames[i * frames.size() / count], mesh));
  }
  return views;
}

} // namespace surflect
