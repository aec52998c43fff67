#include "render/lightfield/lfm/map_drawing.h"

#include "surfel/math/bounds.h"

#include <span>
#include <vector>

namespace surflect::lfm {

namespace {

Vec3<double> middleOfMesh(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = boundsOf(mesh.positions);
  return box.isEmpty() ? Vec3<double>(0, 0, 0) : Vec3<double>(box.center());
}

// Attributes: 0 position; 1 to 3 x axis, 4 to 6 y axis of the frames of the triangle's corners.
gl::VertexArray vertexArrayOf(const LightFieldMaps& maps, const Vec3<double>& middle) {
  std::array<std::vector<Vec3<float>>, 7> values;
  for (const auto& triangle : maps.mesh.triangles)
    for (const uint32_t vertex : triangle) {
      const Vec3<double> p = maps.mesh.positions[vertex].cast<double>().raw() - middle;
      values[0].push_back(p.cast<float>());
      for (size_t corner = 0; corner < 3; ++corner) {
        values[1 + corner].push_back(maps.frames[triangle[corner]].x.cast<float>());
        values[4 + corner].push_back(maps.frames[triangle[corner]].y.cast<float>());
      }
    }
  std::vector<gl::VertexAttribute> attributes;
  for (unsigned location = 0; location < values.size(); ++location)
    attributes.push_back({location, 3, std::as_bytes(std::span(values[location]))});
  return gl::VertexArray(attributes);
}

// Factor and summand that give the value of a texel as OpenGL reads it.
Eigen::Vector2f valueOf(Coding coding, bool isSigned) {
  // 8-bit textures are signed themselves; signed bytes of blocks are stored plus 128.
  return isSigned && coding != Coding::bytes ? Eigen::Vector2f(255.f / 127, -128.f / 127)
                                             : Eigen::Vector2f(1, 0);
}

} // namespace

MapDrawing::MapDrawing(const LightFieldMaps& maps, const gl::Limits& limits)
    : middle_(middleOfMesh(maps.mesh)), boxCentred_(boundsOf(maps.mesh.positions).translated(-middle_)),
      isSigned_(maps.method == Method::pca), hasMean_(maps.mean.maps.count > 0),
      isPacked_(maps.layout == SurfaceLayout::packed), terms_(maps.terms.size()), samples_(maps.samples),
      viewSize_(maps.viewSize), meanWhite_(maps.meanWhite),
      surfaceCoding_(terms_ ? maps.terms[0].surface.maps.coding : Coding::bytes),
      viewCoding_(terms_ ? maps.terms[0].view.maps.coding : Coding::bytes), textures_(maps, limits),
      mesh_(vertexArrayOf(maps, middle_)) {}

std::array<const gl::Texture*, 4> MapDrawing::textures() const {
  return {&textures_.surface(), &textures_.view(), &textures_.mean(), &textures_.places()};
}

Eigen::Isometry3d MapDrawing::cameraFromCentred(const capture::Camera<AcquisitionSpace>& camera) const {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = camera.cameraFromWorld.rotation();
  isometry.translation() = camera.cameraFromWorld.translation();
  return isometry * Eigen::Translation3d(middle_);
}

gl::DepthRange MapDrawing::depthRange(const capture::Camera<AcquisitionSpace>& camera) const {
  return boxCentred_.isEmpty() ? gl::DepthRange{}
                               : gl::depthRangeOf(boxCentred_.transformed(cameraFromCentred(camera)));
}

void MapDrawing::setPosition(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera,
                             const gl::DepthRange& range) const {
  const Eigen::Matrix4d clipFromCamera = gl::clipFromCamera(camera.lens, range);
  program.set("clipFromCentred",
              Eigen::Matrix4f((clipFromCamera * cameraFromCentred(camera).matrix()).cast<float>()));
}

void MapDrawing::setViewer(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera) const {
  program.set("viewerCentred", Eigen::Vector3f((camera.center().raw() - middle_).cast<float>()));
}

void MapDrawing::setMaps(gl::Program& program) const {
  program.set("samples", samples_);
  program.set("viewSize", static_cast<float>(viewSize_));
  program.set("isPacked", isPacked_ ? 1 : 0);
  program.set("surfaceValue", valueOf(surfaceCoding_, isSigned_));
  program.set("viewValue", valueOf(viewCoding_, isSigned_));
  program.set("meanWhite", meanWhite_);
  program.set("termCount", static_cast<int>(terms_));
}

void MapDrawing::setTerms(gl::Program& program, const TermRange& range) {
  program.set("withMean", range.withMean ? 1 : 0);
  program.set("firstTerm", static_cast<int>(range.first));
  program.set("endTerm", static_cast<int>(range.end));
}

} // namespace surflect::lfm
