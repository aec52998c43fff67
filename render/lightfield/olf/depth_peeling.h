// Depth peeling: layers of fragments, each behind the one before, composited front to back by inFrontOf()
// (reference.h).
//
// [Everitt 2001] Everitt: Interactive Order-Independent Transparency.   [Vlasic 2003, §6.2]
// The paper keeps all layers, and blends them back to front; this takes one layer.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/lightfield/olf/frame_parts.h"
#include "surfel/base/time.h"

#include <array>
#include <cstddef>
#include <functional>

namespace surflect::olf {

// A layer that is to be drawn: its fragments are behind those of the layer before.
struct PeeledLayer {
  gl::Framebuffer& target;            // cleared; colours of 32-bit floats, and depths
  const gl::Texture& before;          // depths of the layer before
  bool isFirst;                       // there is none before
  const gl::StorageBuffer& fragments; // a word at the binding kCounter; shaders count their fragments in it
};

class DepthPeeling {
public:
  DepthPeeling(int width, int height);

  int width() const { return color_.shape().width; }
  int height() const { return color_.shape().height; }

  // Calls drawLayer(), which returns the number of fragments, for at most `most` layers, until one has none
  // or no fewer than the one before; and draws each onto the target by a program that reads it as texture 0,
  // and the target's colour as texture 1, such as compose.frag. Throws Cancelled.
  void draw(const gl::Framebuffer& target, const gl::Texture& color, const gl::Program& compose, size_t most,
            FrameCounts& counts, const std::function<size_t(const PeeledLayer&)>& drawLayer,
            const Progress& progress = {});

private:
  gl::Texture color_;
  std::array<gl::Texture, 2> depths_; // of the layer, and of the one before
  std::array<gl::Framebuffer, 2> targets_;
  gl::VertexArray none_;
  gl::StorageBuffer counter_;
};

} // namespace surflect::olf
