// Frames of light field maps by OpenGL.
//
// [Chen 2002] as maps.h. After a depth prepass, Passes says how colours are drawn where depths are
// equal:
//
//   - single: one pass with a loop over all terms
//   - perTerm: a pass for the mean and for each term, added up in a float target [Chen 2002, §3.1]
//   - clamped: a target of 8 bits, 0..1. One pass for the mean and for each positive term; two for a signed
//     term M, which add max(M, 0) and subtract max(-M, 0) [Chen 2002, §3.1]
//
// The first two differ in the last bits of a float. Targets hold roots of radiance (root_radiance.h), which
// are squared when they are read.
#pragma once

#include "render/gl/context.h"
#include "render/gl/draw.h"
#include "render/gl/framebuffer.h"
#include "render/gl/program.h"
#include "render/gl/texture.h"
#include "render/lightfield/lfm/map_drawing.h"
#include "render/lightfield/lfm/maps.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <optional>

namespace surflect::lfm {

enum class Passes { single, perTerm, clamped };

struct FrameOptions {
  Passes passes = Passes::single;
  std::optional<size_t> terms = {}; // the first so many; none: all
  double white = 1;                 // largest radiance in a clamped target
};

struct FrameStats {
  size_t passes = 0; // without the depth prepass
  size_t terms = 0;
  double depthSeconds = 0, drawSeconds = 0, readSeconds = 0;
};

struct Frame {
  image::Image color; // RGBA, premultiplied; alpha is 1 on the object, 0 elsewhere
  image::Image depth; // one channel: distance along the viewing axis; infinite off the object
  FrameStats stats;
};

// Draws frames with the context that is current when it is made.
class FrameRenderer {
public:
  // Throws Error if the maps do not fit into the driver's memory.
  FrameRenderer(const LightFieldMaps& maps, const gl::Limits& limits);

  // Equal arguments give equal bits, whatever was drawn before. Triangles before the near plane, a 10^4th of
  // the distance to the farthest point, are not drawn. Throws Error for a lens that is not a pinhole or
  // distorts, and Cancelled.
  Frame render(const capture::Camera<AcquisitionSpace>& camera, const FrameOptions& options = {},
               const Progress& progress = {});

  const MapTextures& textures() const { return drawing_.maps(); }

private:
  struct Targets {
    gl::Texture color, depth;
    gl::Framebuffer framebuffer;
    Targets(gl::Format format, int width, int height);
  };
  Targets& targetsOf(gl::Format format, int width, int height);
  // Draws terms times a factor: added, or subtracted.
  void drawTerms(const TermRange& range, float factor, bool isSubtracted, const FrameOptions& options,
                 gl::SteppedDraws& draws);
  void drawAll(const FrameOptions& options, const Progress& progress, FrameStats& stats);

  bool isSigned_;
  MapDrawing drawing_;
  gl::Program depth_, maps_;
  std::optional<Targets> targets_;
  double depthStep_ = gl::SteppedDraws::kFirstStep, mapsStep_ = gl::SteppedDraws::kFirstStep;
};

} // namespace surflect::lfm
