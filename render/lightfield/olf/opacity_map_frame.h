// Frames of opacity light field maps by OpenGL: referencePicture() of reference.h in single
// precision, by lists of fragments or by depth peeling.
//
// [Vlasic 2003, §6.2, Appendix A.3]  A layer takes a pass for its depths, then one for all terms together, or
// one for the mean and for each term, as Passes says.
#pragma once

#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/lightfield/lfm/lfm_frame.h"
#include "render/lightfield/lfm/map_drawing.h"
#include "render/lightfield/olf/depth_peeling.h"
#include "render/lightfield/olf/frame_parts.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/per_pixel_lists.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <map>
#include <optional>
#include <string>

namespace surflect::olf {

// Layers of depth peeling, at most.
inline constexpr size_t kMostLayers = 64;

struct MapFrameOptions {
  Order order = Order::list;                // or peel
  lfm::Passes passes = lfm::Passes::single; // of depth peeling; or perTerm
  std::optional<size_t> terms = {};         // the first so many; none: all
  size_t layers = kMostLayers;              // of depth peeling: the nearest so many
};

// Belongs to the current context, as the objects of render/gl do.
class OpacityMapFrame {
public:
  // Throws Error if the maps do not fit into the driver's memory.
  OpacityMapFrame(const OpacityMaps& maps, const gl::Limits& limits);

  // RGBA, premultiplied, of means of side * side of the camera's pixels, which show what is at their centres.
  // Equal arguments give equal bits. Adds seconds by stage: "draw" and "read". Throws Error for a camera that
  // is not a pinhole or distorts, and Cancelled.
  image::Image render(const capture::Camera<AcquisitionSpace>& camera, const MapFrameOptions& options,
                      std::map<std::string, double>& seconds, FrameCounts& counts, int side = 1,
                      const Progress& progress = {});

  const lfm::MapDrawing& drawing() const { return drawing_; }

private:
  struct Target {
    gl::Texture color;
    gl::Framebuffer whole;
    std::optional<DepthPeeling> layers;
    Target(int width, int height);
  };

  void drawLists(size_t terms, FrameCounts& counts, const Progress& progress);
  void drawLayers(size_t terms, const MapFrameOptions& options, FrameCounts& counts,
                  const Progress& progress);
  size_t drawLayer(const PeeledLayer& layer, size_t terms, lfm::Passes passes, FrameCounts& counts,
                   const Progress& progress);

  lfm::MapDrawing drawing_;
  gl::Program list_, layerDepth_, layerMaps_, compose_;
  PerPixelLists lists_;
  std::optional<Target> target_;
  double depthStep_ = gl::SteppedDraws::kFirstStep, mapsStep_ = gl::SteppedDraws::kFirstStep;
  SquareMeans means_;
};

} // namespace surflect::olf
