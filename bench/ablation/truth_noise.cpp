#include "bench/ablation/truth_noise.h"

#include "srf/capture/photograph.h"
#include "srf/image/over_black.h"
#include "srf/image/percentile.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <vector>

namespace surflect::bench {

namespace {

// View by view, all frames of one.
std::vector<image::Image> picturesOf(const capture::Capture& capture, const Progress& progress) {
  std::vector<image::Image> pictures;
  for (size_t view = 0; view < capture.views.size(); ++view) {
    std::vector<size_t> frames;
    for (size_t i = 0; i < capture.frames.size(); ++i)
      if (capture.frames[i].view == view) frames.push_back(i);
    for (const capture::Photograph& photograph : capture::readPhotographs(capture, frames, progress))
      pictures.push_back(image::overBlack(photograph.radiance, photograph.alpha));
  }
  return pictures;
}

double exposureOf(const std::vector<image::Image>& pictures) {
  image::PercentileCounter values;
  for (const image::Image& picture : pictures)
    for (size_t i = 0; i < picture.values.size(); i += 4)
      if (picture.values[i + 3] > 0.5f)
        std::for_each_n(&picture.values[i], 3, [&](float value) { values.add(value); });
  const double white = values.percentile(0.995);
  return white > 0 ? 1 / white : 1;
}

} // namespace

evaluation::Difference differenceOf(const capture::Capture& truth, const capture::Capture& again,
                                    const Progress& progress) {
  if (truth.frames != again.frames)
    throw Error("has other frames than " + truth.file.string()).in(again.file);
  const std::vector<image::Image> first = picturesOf(truth, progress), second = picturesOf(again, progress);
  const double exposure = exposureOf(first);
  evaluation::Difference all;
  for (size_t i = 0; i < first.size(); ++i) all += evaluation::compare(first[i], second[i], exposure);
  return all;
}

} // namespace surflect::bench
