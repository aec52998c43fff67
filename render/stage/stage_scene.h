// Ray casting in the light stage, by Embree in robust mode.
#pragma once

#include "render/stage/material/material.h"
#include "render/stage/surface.h"
#include "srf/image/image.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::stage {

// Textures: factors of a material's colour and roughness.
enum class Texels { colors, factors };

// 3 channels. 8- and 16-bit colours are decoded from sRGB to linear; factors are as stored. Alpha is ignored.
// Throws Error naming the file, also if a float is outside of 0..1 or a colour outside of Rec. 709's gamut.
image::Image readTexels(const std::filesystem::path& picture, Texels what);

class Texture {
public:
  // `texels` from readTexels(), tiled `columns` times across and `rows` times up the surface.
  Texture(std::shared_ptr<const image::Image> texels, int columns, int rows);

  // Bilinear value at texture coordinates; (0, 0) is the picture's lower left corner.
  Rgb at(const Vec2<double>& st) const;

private:
  std::shared_ptr<const image::Image> texels_;
  double columns_, rows_;
};

// Factors of a material's parameters; null where constant.
struct Textures {
  std::shared_ptr<const Texture> color = nullptr;
  std::shared_ptr<const Texture> roughness = nullptr; // the red channel

  bool any() const { return color || roughness; }
};

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

// Returns whether a point is inside of an object: it sees surfaces from behind in all of 14 directions.
bool isInside(const StageScene& scene, const Point3<AcquisitionSpace, double>& point);

} // namespace surflect::stage
