// Meshes in the driver's memory.
#pragma once

#include "render/gl/buffer.h"
#include "surfel/geometry/mesh.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::gl {

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
