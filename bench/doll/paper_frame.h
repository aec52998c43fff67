// A frame by the paper's pipeline as it is printed: one loop over the surfels on one thread, one look-up for
// one surfel, camera and light after the other, everything in double precision but the weights. What the
// program's own frame must show, and what it is measured against.  [Weyrich 2005, §4 and §5]
#pragma once

#include "render/surfels/frame.h"

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace surflect::bench {

// Decoded blocks for as long as this lives, so that a second frame finds all of them in memory.
class ResidentBlocks {
public:
  explicit ResidentBlocks(codec::BlockCache& cache);

  // The block at a texel of a view; null on background.
  const codec::Block* at(uint32_t view, int x, int y);
  codec::BlockCache& cache() { return cache_; }

private:
  codec::BlockCache& cache_;
  std::vector<std::vector<std::shared_ptr<const codec::Block>>>
      blocks_; // per view, by number; null: not asked for yet
};

struct PaperFrame {
  image::Image color; // as Film::color
  size_t visible = 0, lookups = 0;
  std::map<std::string, double, std::less<>> seconds; // for each of kStages
};

// Tangents by four evaluations of the warp [Eq. 6]; penalties of all views and all lights for each surfel.
// Splats are those of cover() on one thread. For models that are a full product, without foreshortening, and
// directional or point lights; throws Error otherwise, and where the warp mirrors.
PaperFrame paperFrame(const model::Model& model, const warp::Warp& warp,
                      const capture::Camera<ObjectSpace>& camera, std::span<const scene::ShotLight> lights,
                      const surfels::FrameOptions& options, ResidentBlocks& blocks);

} // namespace surflect::bench
