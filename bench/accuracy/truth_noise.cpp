// Difference between two captures of one stage with different seeds: the noise of the ground truth, which
// limits the score of any rendering. Measured by the protocol of render/evaluation/measure.h over all frames,
// with the exposure of the first capture.
#include "bench/accuracy/program.h"
#include "srf/capture/capture.h"
#include "srf/capture/photograph.h"
#include "srf/image/image.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <numeric>

namespace surflect::bench {
namespace {

std::vector<image::Image> picturesOf(const capture::Capture& capture) {
  std::vector<size_t> frames(capture.frames.size());
  std::iota(frames.begin(), frames.end(), size_t{0});
  std::vector<image::Image> pictures;
  for (const capture::Photograph& photograph : capture::readPhotographs(capture, frames))
    pictures.push_back(image::overBlack(photograph.radiance, photograph.alpha));
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

Json truthNoise(const Words& words) {
  const capture::Capture truth = capture::readCapture(words[0]), again = capture::readCapture(words[1]);
  if (truth.frames != again.frames)
    throw Error("has other frames than " + truth.file.string()).in(again.file);
  const std::vector<image::Image> first = picturesOf(truth), second = picturesOf(again);
  const double exposure = exposureOf(first);
  evaluation::Difference all;
  for (size_t i = 0; i < first.size(); ++i) all += evaluation::compare(first[i], second[i], exposure);
  return jsonOf(all);
}

} // namespace
} // namespace surflect::bench

int main(int argc, char** argv) {
  return surflect::bench::runProgram(argc, argv, "truth_noise CAPTURE AGAIN", {2},
                                     surflect::bench::truthNoise);
}
