#include "bench/gallery/figures.h"

#include "render/film/frame_file.h"
#include "srf/capture/capture.h"
#include "srf/capture/photograph.h"
#include "srf/image/exr.h"
#include "srf/image/image.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace surflect::bench {

void writeTruthAndDifference(const std::filesystem::path& captureFolder, const std::string& camera,
                             const std::string& light, const std::filesystem::path& rendering,
                             const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const capture::Capture capture = capture::readCapture(captureFolder);
  const auto frame = std::ranges::find_if(capture.frames, [&](const capture::Frame& candidate) {
    return capture.views[candidate.view].identity == camera && candidate.light &&
           capture.lights[*candidate.light].name == light;
  });
  if (frame == capture.frames.end())
    throw Error("has no photograph by " + camera + " under " + light).in(captureFolder);
  const auto index = static_cast<size_t>(frame - capture.frames.begin());
  const capture::Photograph photograph = capture::readPhotographs(capture, std::array{index}).front();
  const image::Image truth = image::overBlack(photograph.radiance, photograph.alpha);
  const image::Image rendered = image::ExrFile(rendering).read({"R", "G", "B", "A"});
  if (rendered.width != truth.width || rendered.height != truth.height)
    throw Error("is not as large as the photograph").in(rendering);

  image::Image difference = truth;
  for (size_t i = 0; i < truth.values.size(); ++i)
    difference.values[i] = i % 4 == 3 ? std::max(truth.values[i], rendered.values[i])
                                      : std::abs(truth.values[i] - rendered.values[i]);
  film::writeFrame(folder / "truth.exr", {truth, {}}, {});
  film::writeFrame(folder / "difference.exr", {difference, {}}, {});
}

} // namespace surflect::bench
