// What rays meet in the light stage, by Embree in robust mode.
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
  Textures textures = {}; // the surface has coordinates where there are any
};

// Where a ray meets a surface.
struct SurfaceHit {
  Point3<AcquisitionSpace, double> position; // on the triangle, to double precision
  double distance;
  Direction3<AcquisitionSpace, double> facet;           // unit normal of the triangle
  Direction3<AcquisitionSpace, double> normal, tangent; // interpolated, of any length, may be 0
  material::Material material;                          // as the textures make it
};

// Something nearer than `distance` is in its way. As Embree takes it: about the middle of the scene.
struct ShadowRay {
  std::array<float, 3> origin, direction;
  float distance;
};
inline constexpr size_t kMostRays = 16;

// What rays have in common, which is only a matter of speed: directions and surroundings, or one at most.
enum class Beam { narrow, wide };

// The material with its colour multiplied (diffuse, or a metal's), and its roughness by 0..1; of a coated one
// those below the coat. What others do not have stays as it is.
material::Material varied(const material::Material& material, const Rgb& colorFactor, double roughnessFactor);

class StageScene {
public:
  // Vertices are recentred in double precision before they go to float. There is at least one triangle.
  explicit StageScene(std::vector<StageObject> objects);
  ~StageScene();

  // `direction` is unit, here and below.
  std::optional<SurfaceHit> firstHit(const Point3<AcquisitionSpace, double>& origin,
                                     const Direction3<AcquisitionSpace, double>& direction) const;
  ShadowRay shadowRay(const Point3<AcquisitionSpace, double>& origin,
                      const Direction3<AcquisitionSpace, double>& direction, double distance) const;
  // Which of the rays have anything in their way: bit i for ray i. At most kMostRays at once.
  uint32_t occluded(std::span<const ShadowRay> rays, Beam beam) const;

  // The origin of a ray that leaves a hit: moved off the triangle, to the ray's side, by 1e-5 of the scene.
  Point3<AcquisitionSpace, double> leaving(const SurfaceHit& hit,
                                           const Direction3<AcquisitionSpace, double>& direction) const;

private:
  struct Rays;
  std::vector<StageObject> objects_;
  std::unique_ptr<const Rays> rays_;
};

} // namespace surflect::stage
