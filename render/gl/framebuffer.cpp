#include "render/gl/framebuffer.h"

#include "render/gl/context.h"
#include "surfel/base/error.h"

#include <epoxy/gl.h>

#include <cassert>

namespace surflect::gl {

namespace {

Handle createdFramebuffer() {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  return {name, [](unsigned n) { glDeleteFramebuffers(1, &n); }};
}

void attach(unsigned framebuffer, GLenum place, const Attachment& attachment) {
  if (attachment.texture->shape().layers > 0)
    glNamedFramebufferTextureLayer(framebuffer, place, attachment.texture->name(), 0, attachment.layer);
  else
    glNamedFramebufferTexture(framebuffer, place, attachment.texture->name(), 0);
}

const char* textOf(GLenum status) {
  switch (status) {
  case GL_FRAMEBUFFER_INCOMPLETE_ATTACHMENT:
    return "an attachment that cannot be drawn into";
  case GL_FRAMEBUFFER_INCOMPLETE_MISSING_ATTACHMENT:
    return "no attachment";
  case GL_FRAMEBUFFER_UNSUPPORTED:
    return "a combination of formats that the driver does not support";
  default:
    return "an incomplete framebuffer";
  }
}

// Clears obey the scissor.
void setScissor(const std::optional<Rect>& rect) {
  if (!rect) return glDisable(GL_SCISSOR_TEST);
  glEnable(GL_SCISSOR_TEST);
  glScissor(rect->x, rect->y, rect->width, rect->height);
}

} // namespace

Framebuffer::Framebuffer(const std::string& name, const std::vector<Attachment>& colors,
                         const Attachment& depth)
    : handle_(createdFramebuffer()) {
  const auto add = [&](GLenum place, const Attachment& attachment) {
    const TextureShape& shape = attachment.texture->shape();
    assert(width_ == 0 || (width_ == shape.width && height_ == shape.height));
    width_ = shape.width;
    height_ = shape.height;
    attach(this->name(), place, attachment);
  };
  std::vector<GLenum> outputs;
  for (const Attachment& color : colors)
    add(outputs.emplace_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(outputs.size())), color);
  if (depth.texture) add(GL_DEPTH_ATTACHMENT, depth);
  glNamedFramebufferDrawBuffers(this->name(), static_cast<GLsizei>(outputs.size()), outputs.data());
  requireNoErrors();
  const GLenum status = glCheckNamedFramebufferStatus(this->name(), GL_DRAW_FRAMEBUFFER);
  if (status != GL_FRAMEBUFFER_COMPLETE)
    throw Error::mismatch("textures that can be drawn into together", textOf(status))
        .at("framebuffer '" + name + "'")
        .in("OpenGL");
}

void Framebuffer::clearColor(size_t attachment, const Eigen::Vector4f& value,
                             const std::optional<Rect>& within, const std::array<bool, 4>& channels) {
  setScissor(within);
  glColorMask(channels[0], channels[1], channels[2], channels[3]);
  glClearNamedFramebufferfv(name(), GL_COLOR, static_cast<GLint>(attachment), value.data());
}

void Framebuffer::clearDepth(float value, const std::optional<Rect>& within) {
  setScissor(within);
  glDepthMask(GL_TRUE);
  glClearNamedFramebufferfv(name(), GL_DEPTH, 0, &value);
}

} // namespace surflect::gl
