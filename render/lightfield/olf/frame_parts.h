// Parts that the frames of both opacity light fields share.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <optional>

namespace surflect::olf {

// Work of a frame in visibility order.
struct FrameCounts {
  size_t passes = 0;    // that draw the mesh
  size_t fragments = 0; // in the lists, or of all layers; not counted for the BSP tree
  size_t layers = 0;    // of depth peeling
};

// Bindings of the shaders' storage buffers.
enum Binding : unsigned { kPieces, kDrawn, kBlends, kPlaces, kHeads, kNodes, kCounter };

// Means of squares of pixels by OpenGL, as image::squareMeans() has them: only the means are read back.

// Belongs to the current context, as the objects of render/gl do.
class SquareMeans {
public:
  SquareMeans();

  // Reads the means of side * side pixels (>= 1) of an RGBA texture, whose sides are multiples of `side`.
  // Throws Cancelled.
  image::Image read(const gl::Texture& picture, int side, const Progress& progress = {});

private:
  struct Target {
    gl::Texture means;
    gl::Framebuffer framebuffer;
    Target(int width, int height);
  };

  gl::Program program_;
  gl::VertexArray none_;
  std::optional<Target> target_;
  double step_ = gl::SteppedDraws::kFirstStep;
};

} // namespace surflect::olf
