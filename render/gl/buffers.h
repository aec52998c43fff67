// OpenGL's names, and its buffers of vertices, indices and storage.
#pragma once

#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace surflect::gl {

// Ownership of one OpenGL object.

// Name of an object that is deleted with its owner; 0 is no object.
class Handle {
public:
  using Delete = void (*)(unsigned name);

  Handle(unsigned name, Delete deleteObject) : name_(name), delete_(deleteObject) {}
  ~Handle() {
    if (name_) delete_(name_);
  }
  Handle(Handle&& other) noexcept : name_(std::exchange(other.name_, 0)), delete_(other.delete_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(name_, other.name_);
    std::swap(delete_, other.delete_);
    return *this;
  }

  unsigned name() const { return name_; }

private:
  unsigned name_;
  Delete delete_;
};

// Immutable arrays in the driver's memory.
class Buffer {
public:
  // Throws Error if there is not enough memory.
  explicit Buffer(std::span<const std::byte> content);

  unsigned name() const { return handle_.name(); }
  size_t bytes() const { return bytes_; }

private:
  Handle handle_;
  size_t bytes_;
};

// Arrays that shaders read and write, at the bindings of their `buffer` blocks.
class StorageBuffer {
public:
  // The content is undefined. Throws Error if there is not enough memory.
  explicit StorageBuffer(size_t bytes);

  size_t bytes() const { return bytes_; }
  // Replaces the first bytes.
  void upload(std::span<const std::byte> content);
  // Sets all words of 32 bits.
  void clear(uint32_t word);
  // Makes the buffer that of a binding, for all draws that follow.
  void bind(unsigned binding) const;
  // A word of 32 bits, after all draws before.
  uint32_t read(size_t word) const;

private:
  Handle handle_;
  size_t bytes_;
};

// Makes what shaders have stored visible to the draws that follow.
void finishStores();

// Meshes in the driver's memory.
struct VertexAttribute {
  unsigned location = 0;                  // in the vertex shader
  int components = 3;                     // floats of a vertex, 1..4
  std::span<const std::byte> values = {}; // #vertices x components floats
};

// Vertices by attribute, and optionally indices, three for each triangle. Without attributes, vertex shaders
// have gl_VertexID alone.
class VertexArray {
public:
  // Throws Error if there is not enough memory.
  explicit VertexArray(std::span<const VertexAttribute> attributes,
                       std::optional<std::span<const uint32_t>> indices = {});

  unsigned name() const { return handle_.name(); }
  // Number of indices, or of vertices if there are no indices.
  size_t size() const { return size_; }
  bool hasIndices() const { return hasIndices_; }
  bool hasVertices() const { return !buffers_.empty(); }
  size_t bytes() const; // of vertices and indices

private:
  Handle handle_;
  std::vector<Buffer> buffers_;
  size_t size_ = 0;
  bool hasIndices_ = false;
};

// Vertex array of a mesh: positions at location 0, and further attributes.
template <class Space>
VertexArray vertexArrayOf(const Mesh<Space>& mesh, std::span<const VertexAttribute> more = {}) {
  std::vector<VertexAttribute> attributes{{0, 3, std::as_bytes(std::span(mesh.positions))}};
  attributes.insert(attributes.end(), more.begin(), more.end());
  const size_t count = 3 * mesh.triangles.size();
  return VertexArray(attributes, std::span(count > 0 ? mesh.triangles.front().data() : nullptr, count));
}

} // namespace surflect::gl
