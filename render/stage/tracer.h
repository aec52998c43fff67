// Pictures of the light stage, by path tracing: one set of paths from the camera serves all lights.
//
// [Kajiya 1986] The rendering equation, SIGGRAPH.
// [Veach 1997] Robust Monte Carlo methods for light transport simulation, §9.2 (multiple importance
// sampling).
//
// At every vertex of a path each light is asked for directly; lights of an extent are also found by the
// directions that surfaces scatter to, and the two ways share by the power heuristic. Directional and point
// lights have no extent, so mirrors and clear glass cannot show them and let none of their light through:
// give directional lights an angular radius where a scene has such materials. Glass casts shadows on what is
// asked for directly; light comes through it by paths that end in a light. Radiance of the lights themselves
// is not in the picture but by way of a surface.
//
// Opaque materials show both sides of a surface. What absorbs along a path is what the last interface says.
#pragma once

#include "render/stage/scene.h"
#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "srf/image/image.h"
#include "surfel/base/progress.h"
#include "surfel/math/angle.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect::stage {

enum class Transport {
  local,  // what the first surface scatters of what falls on it unhindered: no shadows, no interreflection
  direct, // the same with shadows
  full,
};

struct TraceOptions {
  Transport transport = Transport::full;
  int samples = 64; // a pixel; stratified best where it is a product of two numbers of a size
  uint64_t seed = 1;
  Angle lightRadius = Angle(); // of directional lights: discs of even radiance; below 90 degrees
};

struct TracedView {
  std::vector<image::Image>
      radiance;       // one a light; 3 channels, mean over the part of the pixel that is covered
  image::Image alpha; // 1 channel: the share of samples, even over the pixel, that meet a surface
};

// `view` is a number by which its noise differs from that of others. The same bits for any number of threads.
TracedView traceView(const StageScene& scene, const capture::Camera<AcquisitionSpace>& camera, uint64_t view,
                     std::span<const capture::Light> lights, const TraceOptions& options,
                     const Progress& progress);

} // namespace surflect::stage
