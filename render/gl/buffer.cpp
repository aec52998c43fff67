#include "render/gl/buffer.h"

#include "render/gl/context.h"

#include <epoxy/gl.h>

namespace surflect::gl {

namespace {

Handle createdBuffer() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  return {name, [](unsigned n) { glDeleteBuffers(1, &n); }};
}

} // namespace

Buffer::Buffer(std::span<const std::byte> content) : handle_(createdBuffer()), bytes_(content.size()) {
  if (!content.empty()) // OpenGL has no empty storage
    glNamedBufferStorage(name(), static_cast<GLsizeiptr>(content.size()), content.data(), 0);
  requireNoErrors();
}

} // namespace surflect::gl
