// Light field maps in the driver's memory, and the values that programs need to draw them (maps.vert,
// maps.glsl).
#pragma once

#include "render/gl/context.h"
#include "render/gl/program.h"
#include "render/gl/projection.h"
#include "render/gl/texture.h"
#include "render/gl/vertex_array.h"
#include "render/lightfield/lfm/map_textures.h"
#include "render/lightfield/lfm/maps.h"
#include "srf/capture/camera.h"
#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>

namespace surflect::lfm {

// Terms first..end - 1, and the mean before them.
struct TermRange {
  bool withMean = false;
  size_t first = 0, end = 0;
};

class MapDrawing {
public:
  // Throws Error if the maps do not fit into the driver's memory.
  MapDrawing(const LightFieldMaps& maps, const gl::Limits& limits);

  size_t terms() const { return terms_; }
  bool hasMean() const { return hasMean_; }
  const MapTextures& maps() const { return textures_; }
  // Units 0..3 of maps.glsl.
  std::array<const gl::Texture*, 4> textures() const;
  // Three vertices for each triangle.
  const gl::VertexArray& mesh() const { return mesh_; }

  // Depths of the mesh in a camera's pictures.
  gl::DepthRange depthRange(const capture::Camera<AcquisitionSpace>& camera) const;
  // Sets the camera of position.glsl. Throws Error for a lens that is not a pinhole or distorts.
  void setPosition(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera,
                   const gl::DepthRange& range) const;
  // Sets the viewer of maps.vert.
  void setViewer(gl::Program& program, const capture::Camera<AcquisitionSpace>& camera) const;
  // Sets the uniforms of maps.glsl that are the same for each frame.
  void setMaps(gl::Program& program) const;
  static void setTerms(gl::Program& program, const TermRange& range);

private:
  Eigen::Isometry3d cameraFromCentred(const capture::Camera<AcquisitionSpace>& camera) const;

  Vec3<double> middle_;
  Eigen::AlignedBox3d boxCentred_;
  bool isSigned_, hasMean_, isPacked_;
  size_t terms_;
  int samples_, viewSize_;
  float meanWhite_;
  Coding surfaceCoding_, viewCoding_;
  MapTextures textures_;
  gl::VertexArray mesh_;
};

} // namespace surflect::lfm
