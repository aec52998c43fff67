#include "bench/quality/traced_blocks.h"

#include "render/stage/stage_pictures.h"
#include "surfel/base/step_progress.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace surflect::bench {

namespace {

// Block by block along rows, each row's further than the one above by about half of the way to the next.
std::vector<codec::BlockPosition> positions(const capture::Lens& lens, size_t every, size_t first) {
  const size_t shift = every / 2 > 0 ? every / 2 - 1 : 0;
  std::vector<codec::BlockPosition> taken;
  for (int y = 0; y * codec::blockSize < lens.height; ++y)
    for (int x = 0; x * codec::blockSize < lens.width; ++x)
      if ((static_cast<size_t>(x) + shift * static_cast<size_t>(y) + first) % every == 0)
        taken.push_back({x, y});
  return taken;
}

// What it sees of the block, or of what of the block is in the picture.
capture::Camera<AcquisitionSpace> cameraOf(capture::Camera<AcquisitionSpace> camera,
                                           codec::BlockPosition block) {
  capture::Lens& lens = camera.lens;
  const int left = block.x * codec::blockSize, top = block.y * codec::blockSize;
  lens.width = std::min(codec::blockSize, lens.width - left);
  lens.height = std::min(codec::blockSize, lens.height - top);
  lens.centerX -= left;
  lens.centerY -= top;
  return camera;
}

// Pictures of one block each, side by side in a square.
class Mosaic {
public:
  Mosaic(size_t blocks, size_t lights)
      : across_(static_cast<int>(std::ceil(std::sqrt(static_cast<double>(blocks))))) {
    const int side = across_ * codec::blockSize;
    view_.radiance.assign(lights, image::Image(side, side, 3));
    view_.alpha = image::Image(side, side, 1);
  }
  // From many threads at once, each another place.
  void put(size_t place, const stage::TracedView& block) {
    for (size_t light = 0; light < block.radiance.size(); ++light)
      put(place, block.radiance[light], view_.radiance[light]);
    put(place, block.alpha, view_.alpha);
  }
  stage::TracedView take() { return std::move(view_); }

private:
  void put(size_t place, const image::Image& block, image::Image& whole) const {
    const int left = static_cast<int>(place) % across_ * codec::blockSize,
              top = static_cast<int>(place) / across_ * codec::blockSize;
    const auto row = static_cast<std::ptrdiff_t>(block.width * block.channels);
    for (int y = 0; y < block.height; ++y)
      std::copy_n(block.values.begin() + y * row, row, whole.at(left, top + y).begin());
  }

  int across_;
  stage::TracedView view_;
};

} // namespace

std::vector<codec::ReflectanceStack> traceBlocks(const stage::Stage& stage, const BlockSample& sample,
                                                 const Progress& progress) {
  const stage::StageScene scene(stage.objects);
  const std::vector<capture::Light> lights(stage.rig.lights.begin(),
                                           stage.rig.lights.begin() +
                                               static_cast<std::ptrdiff_t>(stage.rig.trainingLights));
  const size_t views = std::min(sample.views, stage.rig.trainingViews);
  std::vector<codec::ReflectanceStack> mosaics;
  for (size_t i = 0; i < views; ++i) {
    const size_t view = i * stage.rig.trainingViews / views;
    const Progress ofView = stepOf(progress, "tracing blocks", i, views);
    ofView("", 0);
    const auto& camera = stage.rig.views[view].camera;
    const std::vector<codec::BlockPosition> taken = positions(camera.lens, sample.every, i);
    Mosaic mosaic(taken.size(), lights.size());
    const Progress quiet{.report = {}, .cancelled = progress.cancelled};
    tbb::parallel_for(size_t{0}, taken.size(), [&](size_t place) {
      const uint64_t noise = uint64_t{view} << 32 | place; // that of no other block
      mosaic.put(place,
                 stage::traceView(scene, cameraOf(camera, taken[place]), noise, lights, stage.trace, quiet));
    });
    mosaics.push_back(stage::asRead(mosaic.take(), ofView).stack);
  }
  return mosaics;
}

} // namespace surflect::bench
