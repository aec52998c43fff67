// Ray casting in the light stage, by Embree in robust mode.
#pragma once

#include "render/stage/material/material.h"
#include "render/stage/surface.h"
#include "render/stage/texture.h"

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::stage {

struct StageObject {
  Surface surface;
  material::Material material;
  Textures textures = {}; // if there are any, the surface has texture coordinates
};

// Intersection of a ray with a surface.
struct SurfaceHit {
  Point3<AcquisitionSpace, double> position; // on the triangle, to double precision
  double distance;
  Direction3<AcquisitionSpace, double> facet;           // unit normal of the triangle
  Direction3<AcquisitionSpace, double> normal, tangent; // interpolated; any length, possibly 0
  material::Material material;                          // with textures applied
};

// Ray that is blocked by anything nearer than `distance`; single precision, relative to the middle of the
// scene.
struct ShadowRay {
  std::array<float, 3> origin, direction;
  float distance;
};
inline constexpr size_t kMostRays = 16;

// Coherence of a set of rays, a hint for speed. narrow: both origins and directions are similar; wide: at
// most one of the two is.
enum class Beam { narrow, wide };

// Material with its diffuse or metal colour multiplied, and its roughness scaled by 0..1; for a coated
// material, those of its base. Factors of parameters that a material does not have are ignored.
material::Material varied(const material::Material& material, const Rgb& colorFactor, double roughnessFactor);

class StageScene {
public:
  // Vertices are recentred in double precision before rounding to float. There is at least one triangle.
  explicit StageScene(std::vector<StageObject> objects);
  ~StageScene();

  // First intersection of a ray; `direction` is unit, here and below.
  std::optional<SurfaceHit> firstHit(const Point3<AcquisitionSpace, double>& origin,
                                     const Direction3<AcquisitionSpace, double>& direction) const;
  ShadowRay shadowRay(const Point3<AcquisitionSpace, double>& origin,
                      const Direction3<AcquisitionSpace, double>& direction, double distance) const;
  // Returns which rays are blocked: bit i for ray i. At most kMostRays at once.
  uint32_t occluded(std::span<const ShadowRay> rays, Beam beam) const;

  // Origin of a ray that leaves a hit: moved off the triangle to the ray's side, by 1e-5 of the scene's size.
  Point3<AcquisitionSpace, double> leaving(const SurfaceHit& hit,
                                           const Direction3<AcquisitionSpace, double>& direction) const;

private:
  struct Rays;
  std::vector<StageObject> objects_;
  std::unique_ptr<const Rays> rays_;
};

} // namespace surflect::stage
