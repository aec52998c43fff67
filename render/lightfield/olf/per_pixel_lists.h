// Per-pixel linked lists of fragments, composited in the order of depths. Fragments at one depth are in the
// order of their triangles.
//
// [Yang 2010] Yang, Hensley, Gruen, Thibieroz: Real-Time Concurrent Linked List Construction on the GPU.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/lightfield/olf/frame_parts.h"
#include "surfel/base/time.h"

#include <optional>
#include <span>

namespace surflect::olf {

class PerPixelLists {
public:
  PerPixelLists();

  // Draws front faces with a program that calls append() of per_pixel_lists.glsl, again with more memory if
  // the fragments do not fit, and writes the composite to the target. Throws Cancelled.
  void draw(const gl::Framebuffer& target, gl::Program& program, std::span<const gl::Texture* const> textures,
            const gl::VertexArray& mesh, const gl::Range& part, FrameCounts& counts,
            const Progress& progress = {});

private:
  gl::Program resolve_;
  gl::VertexArray none_;
  gl::StorageBuffer counter_;
  std::optional<gl::StorageBuffer> heads_, nodes_; // of the last target's size
  double drawStep_ = gl::SteppedDraws::kFirstStep, resolveStep_ = gl::SteppedDraws::kFirstStep;
};

} // namespace surflect::olf
