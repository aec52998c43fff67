#include "srf/validation/small_view.h"

#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "surfel/base/text.h"

#include <algorithm>

namespace surflect::validation {

namespace {

constexpr int kSide = 512; // pixels

// Range of large pixels that small pixel i of `count` averages.
std::pair<int, int> coveredBy(int i, int count, int all) {
  const int first = static_cast<int>(static_cast<int64_t>(i) * all / count);
  return {first, std::max(first + 1, static_cast<int>(static_cast<int64_t>(i + 1) * all / count))};
}

image::Image shrunkTo(const image::Image& image, int width, int height) {
  image::Image small(width, height, image.channels);
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

SmallView smallView(const capture::Capture& capture, size_t frame, const RayCaster<AcquisitionSpace>& mesh) {
  const size_t number = capture.frames[frame].view;
  const capture::Lens& lens = capture.views[number].camera.lens;
  const int step = (std::max(lens.width, lens.height) + kSide - 1) / kSide;
  const int width = std::max(1, lens.width / step), height = std::max(1, lens.height / step);
  SmallView view{number, frame, capture.views[number].camera, {}, {}, {}};
  view.camera.lens = capture::resized(lens, width, height);
  const capture::Photograph photograph = capture::readPhotographs(capture, std::span(&frame, 1))[0];
  view.radiance = shrunkTo(photograph.radiance, width, height);
  if (photograph.hasMatte) view.matte = image::objectMask(shrunkTo(photograph.alpha, width, height));
  view.outline = image::objectMask(capture::silhouette(view.camera, mesh));
  return view;
}

// For each view, the frame whose light is nearest to the camera's direction; none for a view without frames.
std::vector<std::optional<size_t>> frontallyLit(const capture::Capture& capture,
                                                const Point3<AcquisitionSpace, double>& middle) {
  std::vector<std::optional<size_t>> best(capture.views.size());
  std::vector<double> bestCosine(capture.views.size());
  for (size_t i = 0; i < capture.frames.size(); ++i) {
    const capture::Frame& frame = capture.frames[i];
    const capture::Viewpoint viewpoint(capture.views[frame.view].camera);
    const double cosine = frame.light ? dot(capture::towardsLight(capture.lights[*frame.light], middle),
                                            viewpoint.towards(middle))
                                      : 0;
    if (best[frame.view] && !(cosine > bestCosine[frame.view])) continue;
    best[frame.view] = i;
    bestCosine[frame.view] = cosine;
  }
  return best;
}

} // namespace

void forEachSmallView(const capture::Capture& capture, const RayCaster<AcquisitionSpace>& mesh,
                      const Point3<AcquisitionSpace, double>& middle, size_t most, const Progress& progress,
                      const std::function<void(SmallView)>& look) {
  std::vector<size_t> frames;
  for (const auto& frame : frontallyLit(capture, middle))
    if (frame) frames.push_back(*frame);
  const std::vector<size_t> chosen = evenlySpaced(frames.size(), most);
  for (size_t i = 0; i < chosen.size(); ++i) {
    progress("photographs", static_cast<double>(i) / static_cast<double>(chosen.size()));
    look(smallView(capture, frames[chosen[i]], mesh));
  }
}

} // namespace surflect::validation
