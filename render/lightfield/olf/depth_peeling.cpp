#include "render/lightfield/olf/depth_peeling.h"

#include "render/lightfield/olf/frame_parts.h"

#include <limits>

namespace surflect::olf {

DepthPeeling::DepthPeeling(int width, int height)
    : color_({gl::Format::rgba32f, width, height}), depths_{gl::Texture(
                                                                {gl::Format::depth32f, width, height}),
                                                            gl::Texture(
                                                                {gl::Format::depth32f, width, height})},
      targets_{gl::Framebuffer("even layer", {{&color_}}, {&depths_[0]}),
               gl::Framebuffer("odd layer", {{&color_}}, {&depths_[1]})},
      none_({}), counter_(4) {}

void DepthPeeling::draw(const gl::Framebuffer& target, const gl::Texture& color, const gl::Program& compose,
                        size_t most, FrameCounts& counts,
                        const std::function<size_t(const PeeledLayer&)>& drawLayer,
                        const Progress& progress) {
  counter_.bind(kCounter);
  size_t before = std::numeric_limits<size_t>::max(); // fragments of the layer before
  for (size_t layer = 0; layer < most; ++layer) {
    progress.checkpoint();
    gl::Framebuffer& own = targets_[layer % 2];
    own.clearColor(0, {0, 0, 0, 0});
    own.clearDepth();
    counter_.clear(0);
    const size_t found = drawLayer({own, depths_[(layer + 1) % 2], layer == 0, counter_});
    // A layer takes a fragment of each pixel that has any; without this a driver that rounds depths as it
    // stores them would draw for ever.
    if (found == 0 || found >= before) return;
    before = found;
    counts.fragments += found, ++counts.layers;
    const std::array<const gl::Texture*, 2> textures{&color_, &color};
    gl::finishPixels(); // each pixel of the target reads itself
    gl::draw({target, compose, textures}, none_, {0, 3});
  }
}

} // namespace surflect::olf
