#include "render/lightfield/olf/per_pixel_lists.h"

#include "render/lightfield/olf/frame_parts.h"
#include "render/lightfield/olf/shaders.h"

#include <cstddef>

namespace surflect::olf {

namespace {

constexpr size_t kNodeBytes = 4 * 5; // as in per_pixel_lists.glsl

} // namespace

PerPixelLists::PerPixelLists()
    : resolve_(kShaders, {"picture.vert", "per_pixel_lists.frag"}), none_({}), counter_(4) {}

void PerPixelLists::draw(const gl::Framebuffer& target, gl::Program& program,
                         std::span<const gl::Texture* const> textures, const gl::VertexArray& mesh,
                         const gl::Range& part, FrameCounts& counts, const Progress& progress) {
  const size_t pixels = static_cast<size_t>(target.width()) * static_cast<size_t>(target.height());
  if (!heads_ || heads_->bytes() != 4 * pixels) {
    heads_.reset(), nodes_.reset();
    heads_.emplace(4 * pixels);
  }
  if (!nodes_) nodes_.emplace(kNodeBytes * pixels);
  program.set("width", target.width());
  resolve_.set("width", target.width());
  heads_->bind(kHeads), counter_.bind(kCounter);
  while (true) {
    const size_t capacity = nodes_->bytes() / kNodeBytes;
    nodes_->bind(kNodes);
    heads_->clear(0), counter_.clear(0);
    program.set("capacity", static_cast<int>(capacity));
    gl::SteppedDraws(drawStep_, progress)
        .draw(
            {target, program, textures, {.writeColor = {false, false, false, false}, .cull = gl::Cull::back}},
            mesh, part);
    ++counts.passes;
    counts.fragments = counter_.read(0);
    if (counts.fragments <= capacity) break;
    nodes_.emplace(kNodeBytes * counts.fragments * 5 / 4); // and draw again
  }
  gl::finishStores();
  gl::SteppedDraws(resolveStep_, progress).drawRows({target, resolve_, {}, {}}, none_);
}

} // namespace surflect::olf
