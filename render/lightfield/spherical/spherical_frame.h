// Frames of a spherical light field by OpenGL: pencils of the directional sphere, textured by their images
// and summed by their weights, in single precision. reference.h has the plain form.  [Domingo 2007, §3.1]
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/image_cache.h"
#include "render/lightfield/spherical/pencil_weights.h"
#include "render/lightfield/spherical/reference.h"
#include "srf/capture/camera.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::spherical {

// A part of a pencil with the image that is shown for it.
struct TexturedTriangle {
  WeightedTriangle part;
  ImageNumber image = 0;
  uint32_t slot = 0;
};

// Belongs to the current context, as the objects of render/gl do.
class SphericalFrame : public TextureStore {
public:
  // `surface`: mesh of the object. Throws Error if the driver cannot make textures of so many slots.
  SphericalFrame(const DirectionTree& tree, const FieldShape& shape, size_t slots,
                 const TriangleMesh& surface);

  void upload(uint32_t slot, const PencilImage& image) override;

  // Begins a picture with samples x samples for each pixel. Throws Error for a camera that is not a pinhole
  // or distorts, and Cancelled, as the functions below.
  void begin(const capture::Camera<AcquisitionSpace>& camera, const Look& look, int samples,
             const Progress& progress = {});
  // Adds triangles to the picture.
  void add(std::span<const TexturedTriangle> triangles, const Progress& progress = {});
  // The picture; its depth only if it is asked for.
  Picture read(bool depth, const Progress& progress = {});
  size_t textureBytes() const { return textureBytes_; }

private:
  // Sums over the pencils of a level.
  struct Sums {
    gl::Texture color, weightOrDepth; // the latter as in pencils.frag
    gl::Framebuffer framebuffer;
    explicit Sums(const gl::Texture& depth);
  };
  struct Target {
    gl::Texture surface, surfaceDepth; // as in surface.frag
    gl::Framebuffer surfaceFramebuffer;
    std::array<Sums, 2> levels; // the coarser and the finer one of a blend
    Target(int width, int height);
  };
  // Object's mesh in the driver's memory.
  struct Surface {
    gl::VertexArray triangles;
    gl::Texture corners; // as in surface.frag
    Eigen::AlignedBox3d box;
  };
  void drawSurface(const Progress& progress);
  void addLevel(std::span<const TexturedTriangle> triangles, size_t level, const Progress& progress);

  FieldShape shape_;
  std::vector<ImageAxes> axes_; // by image
  gl::Texture colors_, heights_;
  gl::Program program_, surfaceProgram_;
  std::optional<Surface> surface_; // empty if it has no triangles
  double surfaceStep_ = gl::SteppedDraws::kFirstStep, pencilStep_ = gl::SteppedDraws::kFirstStep;
  // State of the picture that was begun.
  bool showsSurface_ = false;
  std::vector<LevelShare> shares_;
  std::optional<Target> target_;
  capture::Camera<AcquisitionSpace> camera_;
  int samples_ = 1;
  size_t textureBytes_ = 0;
};

} // namespace surflect::spherical
