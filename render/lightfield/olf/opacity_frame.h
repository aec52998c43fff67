// Frames of an opacity light field by OpenGL: referencePicture() (reference.h) in single precision, in one of
// three visibility orders. Pieces of a BSP tree come back to front, so that fixed-function blending must
// composite them by over(); the other orders do by inFrontOf().
//
// [Everitt 2001] Everitt: Interactive Order-Independent Transparency.   [Vlasic 2003, §4.2, §6.2]
// The paper caches the texture coordinates of each vertex in its views. Here the fragment shader multiplies
// the point by the matrix of a view: homogeneous coordinates are linear in the point, so this is the same,
// and takes no memory.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/lightfield/olf/bsp_tree.h"
#include "render/lightfield/olf/depth_peeling.h"
#include "render/lightfield/olf/frame_parts.h"
#include "render/lightfield/olf/opacity_field.h"
#include "render/lightfield/olf/per_pixel_lists.h"
#include "render/lightfield/olf/triangle_blends.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace surflect::olf {

// Belongs to the current context, as the objects of render/gl do.
class OpacityFrame {
public:
  // Uploads a field, which must outlive the frame as it is asked for `order`. Throws Error if a driver's
  // limit or memory is exceeded; and Cancelled.
  OpacityFrame(const OpacityField& field, Order order, const Progress& progress = {});

  // RGBA, premultiplied, of means of side * side of the camera's pixels, which show what is at their centres.
  // `blends` are those of the camera's centre.
  // Adds seconds by stage: "order" of the BSP tree, on the CPU; "upload", "draw" and "read". Throws Error for
  // a camera that is not a pinhole or distorts, and Cancelled.
  image::Image render(const capture::Camera<AcquisitionSpace>& camera, std::span<const TriangleBlend> blends,
                      std::map<std::string, double>& seconds, FrameCounts& counts, int side = 1,
                      const Progress& progress = {});

  size_t pieces() const { return pieceCount_; }
  size_t textureBytes() const { return textureBytes_; }
  // Bytes of what is kept beside mesh and pictures, by name.
  std::map<std::string, size_t> auxiliaryBytes() const;

private:
  struct Target {
    gl::Texture color;
    gl::Framebuffer whole;
    std::optional<DepthPeeling> layers; // for depth peeling
    Target(int width, int height, Order order);
  };

  void drawLists(FrameCounts& counts, const Progress& progress);
  void drawLayers(FrameCounts& counts, const Progress& progress);
  void drawSorted(FrameCounts& counts, const Progress& progress);

  const OpacityField& field_;
  Order order_;
  std::optional<BspTree> tree_;
  size_t pieceCount_ = 0;
  Vec3<double> middle_; // positions on the GPU are relative to it
  Eigen::AlignedBox3d box_;
  gl::Texture pictures_;
  gl::StorageBuffer pieces_, drawn_, blends_, places_;
  gl::VertexArray none_;
  gl::Program shade_;
  std::optional<gl::Program> compose_; // of depth peeling
  std::optional<PerPixelLists> lists_;
  std::optional<Target> target_;
  double step_ = gl::SteppedDraws::kFirstStep;
  SquareMeans means_;
  size_t textureBytes_ = 0;
};

} // namespace surflect::olf
