// Frames of a lumigraph by OpenGL: radianceAt() (reconstruction.h) at the geometry's nearest point in each
// pixel, in single precision. The class Reference (reference.h) is the plain form.
#pragma once

#include "render/gl/buffers.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/projection.h"
#include "render/gl/texture.h"
#include "render/lightfield/lumigraph/slab.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace surflect::lumigraph {

// Belongs to the current context, as the objects of render/gl do.
class LumigraphFrame {
public:
  // Uploads a lumigraph, which is not needed afterwards. Throws Error if a driver's limit or memory is
  // exceeded.
  explicit LumigraphFrame(const Lumigraph& lumigraph);

  struct Picture {
    image::Image color; // RGBA, premultiplied
    image::Image
        depth; // one channel: distance along the viewing axis, infinite where alpha is 0; if asked for
  };
  struct Options {
    int samples = 1; // along each side of a pixel: colour is their mean, depth that of the nearest one
    bool depth = false;
  };
  // Pixels, or samples, show what is at their centres. Adds the time of each stage to `seconds`. Throws Error
  // for a camera that is not a pinhole or distorts, and Cancelled.
  Picture render(const capture::Camera<AcquisitionSpace>& camera, const Options& options,
                 std::map<std::string, double>& seconds, const Progress& progress = {});

  size_t triangles() const { return geometry_.size() / 3; }
  size_t textureBytes() const { return textureBytes_; }

private:
  // Distances along the viewing axis of the last draw's samples.
  image::Image distances(const gl::DepthRange& range, const image::Image& color) const;

  struct Target {
    gl::Texture color, depth;
    gl::Framebuffer framebuffer;
    Target(int width, int height);
  };

  Vec3<double> middle_;     // of the geometry: positions on the GPU are relative to it
  Eigen::AlignedBox3d box_; // of these positions
  gl::VertexArray geometry_;
  std::vector<gl::Texture> pictures_; // by slab
  gl::Program depth_, shade_;
  std::optional<Target> target_;
  double depthStep_ = gl::SteppedDraws::kFirstStep, shadeStep_ = gl::SteppedDraws::kFirstStep;
  size_t textureBytes_ = 0;
};

} // namespace surflect::lumigraph
