// Shadow that a deformed cloud casts on the ground of a scene.
//
// Symbols: n unit normal of the ground, p point on it, w(l, p) irradiance of light l at p without the object,
//          as brightness; V(l, p) part of the light that reaches p.
//
//   density(p) = sum w (1 - V) / sum w,   over all lights above the ground
//
// Lamps, and suns of environments, have hard edges: one ray for each corner of a pixel, and 16 within a pixel
// whose corners differ. The other lights of environments have soft shadows: rays from a grid of kSoftStep
// pixels, with bilinear values between, and from each pixel where second differences of the grid are above
// kSoftBend.
#pragma once

#include "render/scene/scene.h"
#include "srf/image/image.h"
#include "srf/weights/environment_map.h"
#include "surfel/base/time.h"
#include "surfel/occluders.h"
#include "warp/deform.h"

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::surfels {

// Environments merged into directional lights for ground shadows, kept for as long as their maps live.
// Unlike those that light the object, they do not depend on the model: many, so that no light has an edge
// that shows.
class GroundEnvironments {
public:
  // Lights of the map. The result lives as long as the map. Throws Cancelled.
  std::span<const weights::EnvironmentLight>
  lightsOf(const std::shared_ptr<const weights::EnvironmentMap>& map, const Progress& progress);

private:
  struct Entry {
    std::weak_ptr<const weights::EnvironmentMap> map;
    std::vector<weights::EnvironmentLight> lights;
  };
  std::list<Entry> entries_;
};

class GroundShadow {
public:
  static constexpr int kSoftStep = 4; // pixels
  static constexpr float kSoftBend = 1.0f / 32;

  // Warps the occluders, which are surfels of the cloud, for a scene that has a ground. Throws Cancelled.
  GroundShadow(const Occluders& occluders, const SurfelCloud& cloud, const scene::Scene& scene,
               GroundEnvironments& environments, const Progress& progress = {})
      : GroundShadow(occluders, warp::deform(subsetOf(cloud, occluders.surfels), scene.warp, progress), scene,
                     environments, progress) {}

  // Density at a point of the ground, 0..1, by a ray to every light; 0 where no light reaches the ground.
  double density(const Point3<ObjectSpace, double>& p) const;

  // The point of the ground that a pixel position shows. Empty where it shows none, or the back of the
  // ground.
  std::optional<Point3<ObjectSpace, double>> pointAt(capture::Pixel pixel) const;

  // Density at each pixel of the scene's camera; 0 off the ground. One channel; the same bits for any number
  // of threads. Throws Cancelled.
  image::Image picture(const Progress& progress = {}) const;

private:
  using GroundPoint = std::optional<Point3<ObjectSpace, double>>;
  struct Light {
    bool isDistant;
    Vec3<double> place; // position, or unit direction towards a distant light
    double strength;    // brightness of intensity, or of irradiance on a surface that faces the light
  };
  struct SoftGrid;
  struct Tile;

  GroundShadow(const Occluders& occluders, const DeformedCloud& deformed, const scene::Scene& scene,
               GroundEnvironments& environments, const Progress& progress);

  double irradianceOf(const Light& light, const Vec3<double>& p) const;
  // Part of the light that the object keeps away from a point, 0..1.
  double blockedOf(const Light& light, const Vec3<double>& p) const;
  double softDensity(const Point3<ObjectSpace, double>& p) const;
  double densityOf(const Point3<ObjectSpace, double>& p, std::span<const double> blocked, double soft) const;
  void blockHard(const GroundPoint& p, std::span<double> blocked) const;
  SoftGrid softGrid(const Progress& progress) const;
  void draw(const Tile& tile, const SoftGrid& soft, image::Image& picture) const;

  scene::ShotGround ground_;
  capture::Camera<ObjectSpace> camera_;
  Rigid<ObjectSpace, CameraSpace> objectFromCamera_;
  std::vector<Light> lights_; // above the ground, hard ones first
  size_t hard_ = 0;           // how many
  double softIrradiance_ = 0; // of all soft lights, the same all over the ground
  Vec3<double> middle_;       // of a sphere around the occluders
  double radius_ = 0;
  SplatCaster<ObjectSpace> caster_;
};

// Alpha that a shadow adds behind an object: (1 - alpha) x strength x density. color: the object's RGBA.
image::Image shadowBehind(const image::Image& color, image::Image density, double strength);

} // namespace surflect::surfels
