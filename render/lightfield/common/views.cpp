#include "render/lightfield/common/views.h"

#include "render/lightfield/common/light_field_folder.h"
#include "srf/capture/photograph.h"
#include "srf/capture/silhouette.h"
#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <system_error>
#include <utility>

namespace surflect::lightfield {

namespace {

void requirePlainPinholes(const capture::Capture& capture) {
  for (const capture::View& view : capture.views) {
    const capture::Lens& lens = view.camera.lens;
    if (lens.model != capture::Lens::Model::pinhole)
      throw Error::mismatch("a pinhole", "an orthographic camera")
          .at("view " + view.identity)
          .in(capture.file);
    for (const auto& [name, value] :
         {std::pair("k1", lens.k1), {"k2", lens.k2}, {"k3", lens.k3}, {"p1", lens.p1}, {"p2", lens.p2}})
      if (value != 0)
        throw Error::mismatch("0, as pictures must be free of distortion", numberText(value))
            .at("view " + view.identity + ": " + name)
            .in(capture.file);
  }
}

} // namespace

capture::Capture fixedLightCapture(const std::filesystem::path& folder, const ViewsOptions& options) {
  capture::Capture capture = capture::subset(capture::readCapture(folder, options.paths),
                                             [](const capture::Frame&) { return true; });
  if (capture.lights.size() > 1)
    throw Error::mismatch("one at most (surflect relight makes views under fixed light)",
                          fmt::format("{} lights", capture.lights.size()))
        .at("lights")
        .in(capture.file);
  if (options.plainPinholes) requirePlainPinholes(capture);
  return capture;
}

namespace {

capture::Capture trainingOf(const capture::Capture& capture) {
  capture::Capture training = capture::subset(
      capture, [](const capture::Frame& frame) { return frame.split == capture::Split::train; });
  if (training.frames.empty()) throw Error::mismatch("training frames", "none").at("frames").in(capture.file);
  return training;
}

} // namespace

Views::Views(const std::filesystem::path& folder, const ViewsOptions& options, const Progress& progress)
    : Views(fixedLightCapture(folder, options), options.mesh, progress) {}

Views::Views(capture::Capture capture, const std::filesystem::path& mesh, const Progress& progress)
    : capture_(std::move(capture)),
      geometry_(proxy::impostorOf(trainingOf(capture_), {.mesh = mesh}, progress)),
      rays_(std::make_unique<const RayCaster<AcquisitionSpace>>(geometry_.mesh, progress)) {}

void Views::replaceMesh(TriangleMesh mesh, const Progress& progress) {
  rays_ = std::make_unique<const RayCaster<AcquisitionSpace>>(mesh, progress);
  geometry_.mesh = std::move(mesh);
}

std::vector<size_t> Views::ofSplit(capture::Split split) const {
  std::vector<size_t> views;
  for (size_t view = 0; view < size(); ++view)
    if (capture_.frames[view].split == split) views.push_back(view);
  return views;
}

image::Image Views::read(size_t view, const Progress& progress) const {
  const capture::Photograph photograph =
      std::move(capture::readPhotographs(capture_, std::array{view}, progress)[0]);
  image::Image picture =
      image::overBlack(photograph.radiance,
                       photograph.hasMatte ? photograph.alpha : capture::silhouette(camera(view), rays()));
  for (const size_t texel : photograph.invalidTexels)
    std::fill_n(&picture.values[4 * texel], 3, std::numeric_limits<float>::quiet_NaN());
  return picture;
}

Views viewsOf(const method::BuildInput& input, const Progress& progress, bool plainPinholes) {
  requireCreatable(input.output);
  requireLightFieldFolder(input.output);
  capture::Capture capture =
      fixedLightCapture(input.source, {.paths = input.paths, .plainPinholes = plainPinholes});
  const capture::Capture training = trainingOf(capture);
  for (const std::string& note : training.notes) input.say(note);
  // All views: a builder gives each a larger share than surfels give one photograph of hundreds.
  const validation::CheckEffort effort{.lightsOfView = 1};
  validation::checkBeforeGeometry(training, effort, input.take, progress);
  Views views(std::move(capture), input.mesh, progress);
  for (const std::string& note : views.geometry().notes) input.say(note);
  validation::checkGeometry(training, views.geometry(), effort, input.take, progress);
  return views;
}

void foretellMemory(const method::BuildInput& input, double bytes, const std::string& what) {
  constexpr double kGibibyte = 1 << 30;
  if (bytes >= kGibibyte)
    input.say(fmt::format("{} take up to {:.1f} GiB of memory", what, bytes / kGibibyte));
}

std::string mebibytes(uint64_t bytes) {
  return fmt::format("{:.1f} MiB", static_cast<double>(bytes) / (1 << 20));
}

uint64_t pictureBytes(const Views& views) {
  uint64_t bytes = 0;
  for (const size_t view : views.ofSplit(capture::Split::train)) {
    std::error_code failure;
    const uint64_t size = std::filesystem::file_size(views.picture(view), failure);
    if (!failure) bytes += size;
  }
  return bytes;
}

double ratioOf(uint64_t whole, uint64_t part) {
  return part > 0 ? static_cast<double>(whole) / static_cast<double>(part) : 0;
}

} // namespace surflect::lightfield
