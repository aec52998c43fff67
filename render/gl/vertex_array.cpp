#include "render/gl/vertex_array.h"

#include "render/gl/context.h"

#include <epoxy/gl.h>

#include <cassert>

namespace surflect::gl {

namespace {

Handle createdVertexArray() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return {name, [](unsigned n) { glDeleteVertexArrays(1, &n); }};
}

} // namespace

VertexArray::VertexArray(std::span<const VertexAttribute> attributes,
                         std::optional<std::span<const uint32_t>> indices)
    : handle_(createdVertexArray()), hasIndices_(indices.has_value()) {
  for (const VertexAttribute& attribute : attributes) {
    const size_t bytes = static_cast<size_t>(attribute.components) * sizeof(float); // of a vertex
    assert(attribute.values.size() % bytes == 0);
    assert(buffers_.empty() || attribute.values.size() / bytes == size_);
    size_ = attribute.values.size() / bytes;
    const GLuint location = attribute.location;
    const Buffer& buffer = buffers_.emplace_back(attribute.values);
    glVertexArrayVertexBuffer(name(), location, buffer.name(), 0, static_cast<GLsizei>(bytes));
    glVertexArrayAttribFormat(name(), location, attribute.components, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(name(), location, location);
    glEnableVertexArrayAttrib(name(), location);
  }
  if (indices) {
    size_ = indices->size();
    glVertexArrayElementBuffer(name(), buffers_.emplace_back(std::as_bytes(*indices)).name());
  }
  requireNoErrors();
}

size_t VertexArray::bytes() const {
  size_t sum = 0;
  for (const Buffer& buffer : buffers_) sum += buffer.bytes();
  return sum;
}

} // namespace surflect::gl
