// Frames of a surface light field by OpenGL, composited in two stages for each pass: basis into alpha, then
// region.
//
// [Azuma 1999] Azuma: Interactive Rendering of Surface Light Fields.
//   B'_i   hat function of sample direction r_i, turned around: a function of ray directions
//   F_i    texture of r_i in a region
// A depth prepass of the whole mesh; then for all regions and directions, in ascending order,
//   basis stage    alpha = B'_i, by drawing the direction mesh, turned around the camera  [§2.3]
//   region stage   colour += alpha F_i, by drawing the region where depths are equal
// The fused method does the same by one draw of the region, which evaluates the hat functions itself; sums
// differ in the last bits of a float.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/projection.h"
#include "render/gl/texture.h"
#include "render/lightfield/slf/field.h"
#include "render/lightfield/slf/pass_plan.h"
#include "render/lightfield/slf/texture_slots.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::slf {

// A field's mesh and direction meshes in the driver's memory.

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

enum class Stages { fused, twoStages };
// Interpolation of hat functions; the fused method has the perspective one alone.
enum class Basis {
  perspective, // exact
  gouraud      // linear on the screen, as in the paper
};

struct FrameOptions {
  Stages method = Stages::fused;
  Basis basis = Basis::perspective;
  PlanOptions plan = {};
  // The basis stage draws only triangles that the region's view may meet. Otherwise it draws all triangles at
  // the pass's direction, after clearing alpha. [Azuma 1999, §3.2]
  bool visitedTriangles = true;
  bool observed = false; // whether to return Frame::observed
  // Whether each of the two stages is drawn. A benchmark leaves one out: the time of that stage is what the
  // frame then saves.
  bool basisStage = true, regionStage = true;
};

struct FrameStats {
  size_t regions = 0, passes = 0, allPasses = 0; // allPasses: textures of the field
  size_t triangles = 0;                          // of the mesh, drawn in region stages
  TextureCounts textures;
  double planSeconds = 0, drawSeconds = 0, readSeconds = 0; // drawSeconds: without textures
};

struct Frame {
  image::Image color;    // RGBA, premultiplied; alpha is 1 on the object, 0 elsewhere
  image::Image depth;    // one channel: distance along the viewing axis; infinite off the object
  image::Image observed; // one channel: the texels' share of observed radiance; empty unless asked for
  FrameStats stats;
};

// Draws frames with the context that is current when it is made.
class FrameRenderer {
public:
  // Field and textures must outlive the renderer. Throws Error if the driver lacks memory.
  FrameRenderer(const Field& field, const Textures& textures, const SlotOptions& options,
                const gl::Limits& limits);

  // Equal arguments give equal bits, whatever was drawn before. Plan options, budgets and policies do not
  // change the bits. Triangles before the near plane, a 10^4th of the distance to the farthest point, are not
  // drawn. Throws Error for a lens that is not a pinhole or distorts, and where texels cannot be read; and
  // Cancelled.
  Frame render(const capture::Camera<AcquisitionSpace>& camera, const FrameOptions& options = {},
               const Progress& progress = {});

  const TextureSlots& slots() const { return slots_; }

private:
  struct Targets {
    gl::Texture color, observed, depth;
    gl::Framebuffer frame, frameWithObserved;
    Targets(int width, int height);
  };
  // One draw of a region: a pass, or in the fused method direction triangles with all of their corners.
  struct Draw {
    const RegionPasses* passes = nullptr;
    std::vector<uint32_t> directions;
    std::span<const uint32_t> triangles;
  };
  struct PlacedDraw {
    Draw draw;
    TextureSlots::Group group;
  };

  Targets& targetsOf(int width, int height);
  std::vector<Draw> drawsOf(const PassPlan& plan, Stages method) const;
  void setCamera(const capture::Camera<AcquisitionSpace>& camera, const gl::DepthRange& range);
  void drawDepth(gl::Framebuffer& target, const Progress& progress);
  // Draws all passes in order, and returns the number of the mesh's triangles drawn.
  size_t drawAll(std::span<const Draw> draws, gl::Framebuffer& target, const FrameOptions& options,
                 const Progress& progress);
  void drawPlaced(const PlacedDraw& placed, gl::Framebuffer& target, const FrameOptions& options,
                  gl::SteppedDraws& stepped);
  void drawBasis(const Draw& draw, gl::Framebuffer& target, const FrameOptions& options);
  void drawRegion(const PlacedDraw& placed, gl::Framebuffer& target, gl::SteppedDraws& stepped);
  void drawFused(const PlacedDraw& placed, gl::Framebuffer& target, gl::SteppedDraws& stepped);
  Frame read(const Targets& targets, const gl::DepthRange& range, const FrameOptions& options,
             const Progress& progress) const;

  const Field* field_;
  FieldBuffers buffers_;
  TextureSlots slots_;
  PassPlanner planner_;
  gl::VertexArray cornersOnly_{{}};
  gl::Program depth_, basis_, gouraud_, region_, fused_;
  std::optional<Targets> targets_;
  double depthStep_ = gl::SteppedDraws::kFirstStep, regionStep_ = gl::SteppedDraws::kFirstStep;
};

} // namespace surflect::slf
