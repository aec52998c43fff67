#include "render/gl/buffers.h"

#include "render/gl/context.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cassert>

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

namespace {

Handle createdStorage() {
  GLuint name = 0;
  glCreateBuffers(1, &name);
  return {name, [](unsigned n) { glDeleteBuffers(1, &n); }};
}

} // namespace

StorageBuffer::StorageBuffer(size_t bytes) : handle_(createdStorage()), bytes_(std::max<size_t>(4, bytes)) {
  glNamedBufferStorage(handle_.name(), static_cast<GLsizeiptr>(bytes_), nullptr, GL_DYNAMIC_STORAGE_BIT);
  requireNoErrors();
}

void StorageBuffer::upload(std::span<const std::byte> content) {
  assert(content.size() <= bytes_);
  if (content.empty()) return;
  glNamedBufferSubData(handle_.name(), 0, static_cast<GLsizeiptr>(content.size()), content.data());
}

void StorageBuffer::clear(uint32_t word) {
  glClearNamedBufferData(handle_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &word);
}

void StorageBuffer::bind(unsigned binding) const {
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, binding, handle_.name());
}

uint32_t StorageBuffer::read(size_t word) const {
  assert(4 * (word + 1) <= bytes_);
  glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  uint32_t value = 0;
  glGetNamedBufferSubData(handle_.name(), static_cast<GLintptr>(4 * word), 4, &value);
  return value;
}

void finishStores() { glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT); }

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
