// Means of squares of pixels by OpenGL, as image::squareMeans() has them: only the means are read back.
#pragma once

#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/gl/vertex_array.h"
#include "srf/image/image.h"

#include <optional>

namespace surflect::olf {

// Belongs to the current context, as the objects of render/gl do.
class SquareMeans {
public:
  SquareMeans();

  // Reads the means of side * side pixels (>= 1) of an RGBA texture, whose sides are multiples of `side`.
  image::Image read(const gl::Texture& picture, int side);

private:
  struct Target {
    gl::Texture means;
    gl::Framebuffer framebuffer;
    Target(int width, int height);
  };

  gl::Program program_;
  gl::VertexArray none_;
  std::optional<Target> target_;
};

} // namespace surflect::olf
