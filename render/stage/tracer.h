// Path tracer of the light stage: one set of paths from the camera serves all lights.
//
// [Kajiya 1986] The rendering equation, SIGGRAPH. [Veach 1997] Robust Monte Carlo methods for light transport
// simulation, §9.2 (multiple importance sampling).
//
// Each light is sampled directly at every vertex of a path. Lights with an extent are also hit by scattered
// directions, and the power heuristic combines both. Directional and point lights have no extent, so mirrors
// and clear glass neither show them nor transmit their light: give directional lights an angular radius in
// scenes with such materials. Glass casts shadows for direct sampling; light passes through it only along
// paths that hit a light. The camera does not see lights directly, only by way of a surface.
//
// Opaque materials are two-sided. Absorption along a path follows the last interface that it crossed.
#pragma once

#include "render/stage/stage_scene.h"
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
  local,  // scattering at the first surface as if it were alone: no shadows, no interreflection
  direct, // local, with shadows
  full,
};

enum class Matte {
  coverage,      // alpha is the share of a pixel that the object covers
  transmittance, // likewise, less the light that passes from behind through glass, refracted but not
                 // reflected
};

struct TraceOptions {
  Transport transport = Transport::full;
  Matte matte = Matte::coverage;
  int samples = 64; // per pixel; stratified best if a product of two similar numbers
  uint64_t seed = 1;
  Angle lightRadius = Angle(); // directional lights are discs of even radiance; below 90 degrees
};

struct TracedView {
  std::vector<image::Image> radiance; // one per light; 3 channels, not multiplied by alpha
  image::Image alpha;                 // 1 channel, of samples that are even over the pixel; see Matte
};

// Pictures of one camera under all lights. `view` keys the noise. Gives the same bits for any number of
// threads.
TracedView traceView(const StageScene& scene, const capture::Camera<AcquisitionSpace>& camera, uint64_t view,
                     std::span<const capture::Light> lights, const TraceOptions& options,
                     const Progress& progress);

} // namespace surflect::stage
