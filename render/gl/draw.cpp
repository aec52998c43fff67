#include "render/gl/draw.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <utility>

namespace surflect::gl {

namespace {

GLenum named(Factor factor) {
  switch (factor) {
  case Factor::zero:
    return GL_ZERO;
  case Factor::one:
    return GL_ONE;
  case Factor::sourceAlpha:
    return GL_SRC_ALPHA;
  case Factor::oneMinusSourceAlpha:
    return GL_ONE_MINUS_SRC_ALPHA;
  case Factor::targetColor:
    return GL_DST_COLOR;
  case Factor::targetAlpha:
    return GL_DST_ALPHA;
  case Factor::oneMinusTargetAlpha:
    return GL_ONE_MINUS_DST_ALPHA;
  }
  std::abort();
}

GLenum named(Compare compare) {
  switch (compare) {
  case Compare::always:
    return GL_ALWAYS;
  case Compare::less:
    return GL_LESS;
  case Compare::lessEqual:
    return GL_LEQUAL;
  case Compare::equal:
    return GL_EQUAL;
  case Compare::greater:
    return GL_GREATER;
  }
  std::abort();
}

void enable(GLenum capability, bool enabled) { enabled ? glEnable(capability) : glDisable(capability); }

// Sets all of a state, for a framebuffer of the given size.
void apply(const RenderState& state, int width, int height) {
  const Rect whole{0, 0, width, height};
  const Rect viewport = state.viewport.value_or(whole), scissor = state.scissor.value_or(whole);
  glViewport(viewport.x, viewport.y, viewport.width, viewport.height);
  enable(GL_SCISSOR_TEST, state.scissor.has_value());
  glScissor(scissor.x, scissor.y, scissor.width, scissor.height);

  const bool adds = state.blend.equation == Equation::add;
  const bool replaces = adds && state.blend.source == Factor::one && state.blend.target == Factor::zero;
  enable(GL_BLEND, !replaces);
  glBlendEquation(adds ? GL_FUNC_ADD : GL_FUNC_REVERSE_SUBTRACT);
  glBlendFunc(named(state.blend.source), named(state.blend.target));
  const auto& [red, green, blue, alpha] = state.writeColor;
  glColorMask(red, green, blue, alpha);

  // Depth is written only if it is tested.
  enable(GL_DEPTH_TEST, state.writeDepth || state.depth != Compare::always);
  glDepthFunc(named(state.depth));
  glDepthMask(state.writeDepth);

  enable(GL_CULL_FACE, state.cull != Cull::none);
  glCullFace(state.cull == Cull::front ? GL_FRONT : GL_BACK);
}

} // namespace

void draw(const Pass& pass, const VertexArray& mesh, const Range& part, Primitive primitive) {
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, pass.target.name());
  apply(pass.state, pass.target.width(), pass.target.height());
  glUseProgram(pass.program.name());
  assert(pass.textures.size() <= kTextureUnits);
  std::array<GLuint, kTextureUnits> textures{};
  std::ranges::transform(pass.textures, textures.begin(), &Texture::name);
  glBindTextures(0, static_cast<GLsizei>(textures.size()), textures.data());
  glBindVertexArray(mesh.name());
  const GLenum mode = primitive == Primitive::triangles ? GL_TRIANGLES : GL_POINTS;
  const auto count = static_cast<GLsizei>(part.count);
  assert(part.first + part.count <= mesh.size() || !mesh.hasVertices());
  if (mesh.hasIndices()) {
    const auto offset = part.first * sizeof(uint32_t);
    glDrawElements(mode, count, GL_UNSIGNED_INT, reinterpret_cast<const void*>(offset));
  } else {
    glDrawArrays(mode, static_cast<GLint>(part.first), count);
  }
}

SteppedDraws::SteppedDraws(double& step, const Progress& progress)
    : step_(step), progress_(progress),
      drawn_(nullptr, [](void* fence) { glDeleteSync(static_cast<GLsync>(fence)); }) {}

size_t SteppedDraws::room(double work) const {
  const double count = (step_ - queued_) / work;
  return count < 1 ? 1 : static_cast<size_t>(std::min(count, 1e12));
}

void SteppedDraws::add(double work) {
  constexpr double kSeconds = 0.01; // of a step
  queued_ += work;
  if (queued_ < step_) return;
  const auto before =
      std::exchange(drawn_, {glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0), drawn_.get_deleter()});
  glFlush();
  if (before) {
    glClientWaitSync(static_cast<GLsync>(before.get()), 0, GL_TIMEOUT_IGNORED);
    step_ = std::clamp(before_ * kSeconds / watch_.seconds(), step_ / 8, 1.5 * step_);
  }
  before_ = std::exchange(queued_, 0);
  watch_ = {};
  progress_.checkpoint();
}

void SteppedDraws::draw(const Pass& pass, const VertexArray& mesh, const Range& part) {
  if (!progress_.cancelled) return gl::draw(pass, mesh, part);
  const double pixels = double{1} * pass.target.width() * pass.target.height();
  for (size_t first = part.first, end = part.first + part.count; first < end;) {
    const size_t count = std::min(end - first, 3 * room(pixels));
    gl::draw(pass, mesh, {first, count});
    first += count;
    add(static_cast<double>(count) / 3 * pixels);
  }
}

void SteppedDraws::drawRows(const Pass& pass, const VertexArray& mesh) {
  if (!progress_.cancelled) return gl::draw(pass, mesh, {0, 3});
  assert(!pass.state.scissor);
  const int width = pass.target.width(), height = pass.target.height();
  for (int y = 0; y < height;) {
    const int rows = static_cast<int>(std::min<size_t>(static_cast<size_t>(height - y), room(width)));
    Pass band = pass;
    band.state.scissor = Rect{0, y, width, rows};
    gl::draw(band, mesh, {0, 3});
    y += rows;
    add(double{1} * rows * width);
  }
}

void finishPixels() { glTextureBarrier(); }

void draw(const Pass& pass, const VertexArray& mesh, Primitive primitive) {
  draw(pass, mesh, {0, mesh.size()}, primitive);
}

} // namespace surflect::gl
