// A field's mesh and direction meshes in the driver's memory.
#pragma once

#include "render/gl/draw.h"
#include "render/gl/texture.h"
#include "render/gl/vertex_array.h"
#include "render/lightfield/slf/field.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

// Rows of the inverse of the matrix whose columns are a triangle's corners. The product of row c with a
// direction is the hat function of corner c there, up to a factor that the three rows share.
Mat3<double> hatRows(const DirectionMesh& mesh, size_t triangle);

class FieldBuffers {
public:
  // Needs a current context, as everything in render/gl does.
  explicit FieldBuffers(const Field& field);

  // Middle of the mesh's box, from which positions in shaders count.
  const Vec3<double>& middle() const { return middle_; }
  const Eigen::AlignedBox3d& boxCentred() const { return boxCentred_; }
  // Attributes: 0 position, 1 texture coordinates in texels.
  const gl::VertexArray& mesh() const { return mesh_; }
  gl::Range partOf(size_t region) const { return parts_[region]; }

  // Corners of a direction mesh's triangles, three each: direction, and its number.
  std::span<const Eigen::Vector4f> corners(size_t directionMesh) const { return corners_[directionMesh]; }
  // hatRows() of each triangle, three each; the last component is 0.
  std::span<const Eigen::Vector4f> rows(size_t directionMesh) const { return rows_[directionMesh]; }
  // rows() as a texture: column corner, row triangle.
  const gl::Texture& rowTexture(size_t directionMesh) const { return rowTextures_[directionMesh]; }
  // Generous bound of the rounding of a hatRows() product with a unit direction. A triangle whose hats are
  // all above it holds the direction: every other triangle has a lesser hat.
  float sureHat(size_t directionMesh) const { return sureHats_[directionMesh]; }

private:
  Vec3<double> middle_;
  Eigen::AlignedBox3d boxCentred_;
  std::vector<gl::Range> parts_;
  gl::VertexArray mesh_;
  std::vector<std::vector<Eigen::Vector4f>> corners_, rows_;
  std::vector<gl::Texture> rowTextures_;
  std::vector<float> sureHats_;
};

} // namespace surflect::slf
