#include "render/lightfield/slf/field_buffers.h"

#include "surfel/math/bounds.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>

namespace surflect::slf {

namespace {

Vec3<double> middleOfField(const Field& field) {
  const Eigen::AlignedBox3d box = boundsOf(field.mesh.positions);
  return box.isEmpty() ? Vec3<double>(0, 0, 0) : Vec3<double>(box.center());
}

// Vertices of all charts, one after the other: those on borders occur in several.
gl::VertexArray meshOf(const Field& field, const Vec3<double>& middle, std::vector<gl::Range>& parts) {
  std::vector<std::array<float, 3>> positions;
  std::vector<std::array<float, 2>> texels;
  std::vector<uint32_t> indices;
  for (const Region& region : field.regions) {
    const Chart& chart = region.chart;
    const auto first = static_cast<uint32_t>(positions.size());
    parts.push_back({indices.size(), 3 * chart.triangles.size()});
    for (size_t i = 0; i < chart.vertices.size(); ++i) {
      const Vec3<float> p =
          (field.mesh.positions[chart.vertices[i]].cast<double>().raw() - middle).cast<float>();
      positions.push_back({p.x(), p.y(), p.z()});
      texels.push_back({chart.coordinates[i].x() * static_cast<float>(chart.width),
                        chart.coordinates[i].y() * static_cast<float>(chart.height)});
    }
    for (const auto& triangle : chart.triangles)
      for (const uint32_t corner : triangle) indices.push_back(first + corner);
  }
  const std::array attributes{gl::VertexAttribute{0, 3, std::as_bytes(std::span(positions))},
                              gl::VertexAttribute{1, 2, std::as_bytes(std::span(texels))}};
  return gl::VertexArray(attributes, indices);
}

} // namespace

Mat3<double> hatRows(const DirectionMesh& mesh, size_t triangle) {
  Mat3<double> corners;
  for (int corner = 0; corner < 3; ++corner)
    corners.col(corner) = mesh.directions()[mesh.triangles()[triangle][static_cast<size_t>(corner)]].raw();
  return corners.inverse();
}

FieldBuffers::FieldBuffers(const Field& field)
    : middle_(middleOfField(field)), boxCentred_(boundsOf(field.mesh.positions).translated(-middle_)),
      mesh_(meshOf(field, middle_, parts_)) {
  for (const DirectionMesh& mesh : field.directionMeshes) {
    auto& corners = corners_.emplace_back();
    auto& rows = rows_.emplace_back();
    for (size_t t = 0; t < mesh.triangles().size(); ++t) {
      const Mat3<float> inverse = hatRows(mesh, t).cast<float>();
      for (size_t c = 0; c < 3; ++c) {
        const uint32_t direction = mesh.triangles()[t][c];
        const Vec3<float> r = mesh.directions()[direction].cast<float>().raw();
        corners.emplace_back(r.x(), r.y(), r.z(), static_cast<float>(direction));
        const auto row = inverse.row(static_cast<Eigen::Index>(c));
        rows.emplace_back(row[0], row[1], row[2], 0.f);
      }
    }
    float longest = 0;
    for (const Eigen::Vector4f& row : rows) longest = std::max(longest, row.norm());
    sureHats_.push_back(1e-6f * longest);
    gl::Texture& texture = rowTextures_.emplace_back(gl::TextureShape{
        gl::Format::rgba32f, 3, static_cast<int>(mesh.triangles().size()), 0, 1, gl::Filter::nearest});
    texture.upload(std::as_bytes(std::span(rows)), 3, texture.shape().height);
  }
}

} // namespace surflect::slf
