// Radiance that surfels send towards distant viewers: the shading of frames, without a picture.
#pragma once

#include "render/scene/scene.h"
#include "render/surfels/cast_shadows.h"
#include "render/surfels/frame.h"
#include "srf/shading/shade.h"
#include "surfel/cloud.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::surfels {

// Surfels of a field: a level of detail, or all of them.
struct DrawnSurfels {
  SurfelCloud cloud;
  std::vector<uint32_t> surfels; // per entry: its index in the field, ascending
};

// The finest level of detail of a field with at most `most` surfels, or its coarsest. Throws Cancelled.
DrawnSurfels drawnSurfels(const weights::ReflectanceField& field, size_t most, const Progress& progress = {});

// Surfels under the warp and the lights of a scene, whose camera has no effect. Lights and shadows are
// prepared when radiance is first asked for, so that shapes alone are cheap.
class OutgoingRadiance {
public:
  // The arguments must outlive this, but for the scene, whose warp must. Throws Error as renderFrame, and
  // Cancelled.
  OutgoingRadiance(const weights::ReflectanceField& field, const DrawnSurfels& drawn,
                   const scene::Scene& scene, const FrameOptions& options, FrameWorkspace& workspace,
                   const Progress& progress = {});

  // One entry per drawn surfel.
  const SurfelCloud& cloud() const { return drawn_.cloud; }
  const DeformedCloud& deformed() const { return deformed_; }

  // Radiance of each of `surfels`, entries of the drawn cloud that are not dead, towards a viewer in this
  // unit direction. Equals the shading of renderFrame for an orthographic camera, with a query per surfel.
  // Calls come from one thread. Throws Error as renderFrame and shade, and Cancelled.
  shading::Shaded towards(const Direction3<ObjectSpace, double>& viewer, std::span<const uint32_t> surfels,
                          const Progress& progress = {}) const;

private:
  const weights::ReflectanceField& field_;
  const DrawnSurfels& drawn_;
  const FrameOptions& options_;
  FrameWorkspace& workspace_;
  const scene::Scene scene_;
  DeformedCloud deformed_;

  struct Light {
    LitScene lit;
    DeformedCloud tangents; // for L; empty if they are those of the deformed cloud
    std::optional<CastShadows> shadows;
  };
  std::unique_ptr<Light> lightOf(const Progress& progress) const;
  mutable std::unique_ptr<const Light> light_; // once asked for
};

} // namespace surflect::surfels
