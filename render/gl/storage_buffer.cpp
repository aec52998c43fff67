#include "render/gl/storage_buffer.h"

#include "render/gl/context.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cassert>

namespace surflect::gl {

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

} // namespace surflect::gl
