#include "render/lightfield/olf/frame_parts.h"

#include "render/gl/draw.h"
#include "render/lightfield/olf/shaders.h"

#include <array>
#include <cassert>

namespace surflect::olf {

SquareMeans::Target::Target(int width, int height)
    : means({gl::Format::rgba32f, width, height}), framebuffer("means", {{&means}}) {}

SquareMeans::SquareMeans() : program_(kShaders, {"picture.vert", "means.frag"}), none_({}) {}

image::Image SquareMeans::read(const gl::Texture& picture, int side, const Progress& progress) {
  progress.checkpoint();
  const int width = picture.shape().width / side, height = picture.shape().height / side;
  assert(side * width == picture.shape().width && side * height == picture.shape().height);
  if (side == 1) return picture.read();
  if (!target_ || target_->means.shape().width != width || target_->means.shape().height != height) {
    target_.reset();
    target_.emplace(width, height);
  }
  program_.set("side", side);
  const std::array<const gl::Texture*, 1> textures{&picture};
  gl::SteppedDraws(step_, progress).drawRows({target_->framebuffer, program_, textures}, none_);
  progress.checkpoint();
  return target_->means.read();
}

} // namespace surflect::olf
