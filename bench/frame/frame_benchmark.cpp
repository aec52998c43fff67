#include "bench/frame/frame_benchmark.h"

#include "bench/doll/doll_model.h"
#include "render/splat/reference.h"
#include "srf/image/image_file.h"
#include "surfel/base/file.h"
#include "surfel/math/bounds.h"
#include "warp/deform.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fcntl.h>
#include <unistd.h>

namespace surflect::bench {

namespace {

constexpr size_t kCacheBytes = size_t{4} << 30; // more than a frame needs

using SharedModel = std::shared_ptr<const model::Model>;

// Wraps a function so that it makes the model on its first call and returns the same one afterwards.
std::function<SharedModel()> once(std::function<model::Model()> make) {
  return [make = std::move(make), kept = std::make_shared<SharedModel>()] {
    if (!*kept) *kept = std::make_shared<const model::Model>(make());
    return *kept;
  };
}

model::Model withMoreSurfels(const model::Model& model, size_t times) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const capture::View& view : model.rig.views) cameras.push_back(view.camera);
  DollSurface surface = dollSurface(times * model.cloud.size(), DollSize().seed, cameras);
  model::Model other = everyView(model, 1);
  other.cloud = std::move(surface.cloud);
  other.middle = middleOf(other.cloud.p0);
  other.visibility = std::move(surface.visibility);
  return other;
}

} // namespace

WarmFrame::WarmFrame(SharedModel model, Shot shot)
    : model_(std::move(model)), shot_(std::move(shot)), workspace_(*model_, kCacheBytes) {
  render();
  first_ = workspace_.stats;
}

const surfels::FrameLayers& WarmFrame::render() {
  workspace_.layers =
      surfels::renderFrame(*model_, {*shot_.warp, shot_.camera, shot_.lights}, shot_.options, workspace_);
  return workspace_.layers;
}

FrameCounts countsOf(const WarmFrame& frame) {
  const model::Model& model = frame.model();
  const Shot& shot = frame.shot();
  const surfels::FrameStats& stats = frame.first();
  FrameCounts counts;
  counts.surfels = stats.surfels;
  counts.drawn = stats.splats.drawn;
  counts.visible = stats.visible;
  counts.pixels = static_cast<size_t>(shot.camera.lens.width) * static_cast<size_t>(shot.camera.lens.height);
  counts.views = model.rig.views.size();
  counts.rigLights = model.rig.lights.size();
  counts.lights = shot.lights.size();
  counts.pairs = stats.shading.operations;
  counts.lookups = stats.shading.lookups;
  counts.blocks = stats.shading.blocksRead;
  counts.blockBytes = stats.shading.bytesRead;
  counts.rank = static_cast<double>(stats.shading.taskRanks) / static_cast<double>(stats.shading.tasks);
  const DeformedCloud deformed = warp::deform(model.cloud, *shot.warp);
  for (const auto& pixel :
       splat::referenceRaster(shot.camera, splat::splatsOf(model.cloud, deformed), shot.options.splats)
           .weights)
    counts.contributions += pixel.size();
  return counts;
}

void forgetFiles(const model::Model& model) {
  for (const codec::ViewFile& file : model.files) {
    const int descriptor = openForReading(file.path());
    ::posix_fadvise(descriptor, 0, 0, POSIX_FADV_DONTNEED);
    ::close(descriptor);
  }
}

std::vector<FrameBenchmark> growthBenchmarks(SharedModel model, int width, int height, size_t lights) {
  std::vector<FrameBenchmark> rows;
  const auto add = [&](const char* what, size_t size, std::function<std::unique_ptr<WarmFrame>()> make) {
    rows.push_back(
        {fmt::format("growth/{}/{}", what, size), what, static_cast<double>(size), std::move(make)});
  };
  const auto shown = [=](const std::function<SharedModel()>& of, size_t count, int scale) {
    return [=] {
      const SharedModel shared = of();
      return std::make_unique<WarmFrame>(shared,
                                         dollShot(shared->cloud, scale * width, scale * height, count));
    };
  };
  const auto whole = [model] { return model; };
  const auto quarter = once([model] { return everyView(*model, 4); });
  const size_t views = model->rig.views.size(), surfels = model->cloud.size();
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);

  add("views", (views + 3) / 4, shown(quarter, lights, 1));
  add("views", (views + 1) / 2, shown(once([model] { return everyView(*model, 2); }), lights, 1));
  add("pixels", 4 * pixels, shown(whole, lights, 2));
  add("lights", 1, shown(whole, 1, 1));
  add("lights", 60, shown(whole, 60, 1));
  for (const size_t times : {size_t{1}, size_t{2}, size_t{4}})
    add("surfels", times * surfels,
        shown(once([=] { return withMoreSurfels(*quarter(), times); }), lights, 1));
  add("environments", 1, [=] {
    Shot shot = dollShot(model->cloud, width, height, 1);
    const auto studio = std::make_shared<const weights::EnvironmentMap>(weights::environmentOf(
        image::readPicture(SURFLECT_STUDIO).image, weights::EnvironmentMapping::latLong));
    const Mat3<double> upright = // maps y of the studio to z
        Eigen::AngleAxisd(std::numbers::pi / 2, Vec3<double>::UnitX()).toRotationMatrix();
    shot.lights = {scene::ShotEnvironment{studio, Rotation<ObjectSpace, EnvironmentSpace>(upright)}};
    return std::make_unique<WarmFrame>(model, std::move(shot));
  });
  return rows;
}

} // namespace surflect::bench
