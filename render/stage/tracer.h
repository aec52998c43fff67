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

#include "render/stage/material/shading.h"
#include "render/stage/stage_scene.h"
#include "srf/capture/camera.h"
#include "srf/capture/rig.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <variant>
#include <vector>

namespace surflect::stage {

// A captured light as the path tracer samples it.

// A light as seen by a path. Discs have an extent; point and other directional lights have none.
class Lamp {
public:
  using Vector = Vec3<double>;
  using Point = Point3<AcquisitionSpace, double>;
  using Direction = Direction3<AcquisitionSpace, double>;

  // Sampled direction to the light, and the irradiance of a surface that faces it; for a disc, radiance over
  // density.
  struct Sample {
    Direction towards;
    Rgb irradiance;
    double distance;
  };

  Lamp(const capture::Light& light, Angle radius) : height_(capHeight(radius)) {
    if (const auto* point = std::get_if<capture::PointLight>(&light.kind)) {
      position_ = point->position;
      strength_ = point->intensity;
      return;
    }
    const auto& directional = std::get<capture::DirectionalLight>(light.kind);
    isPoint_ = false;
    middle_ = directional.towards;
    gradient_ = directional.irradianceGradient;
    isDisc_ = radius.radians() > 0;
    x_ = middle_.raw().unitOrthogonal();
    y_ = middle_.raw().cross(x_);
    strength_ =
        isDisc_ ? material::scaled(discRadiance(radius), directional.irradiance) : directional.irradiance;
  }

  Sample sample(const Point& p, double u, double v) const {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    if (isPoint_) {
      const Direction d = position_ - p;
      const double distance = length(d);
      return {(1 / distance) * d, material::scaled(1 / material::squared(distance), strength_), distance};
    }
    const double gain = capture::gainAt(gradient_, p.raw());
    if (!isDisc_) return {middle_, material::scaled(gain, strength_), kFar};
    const double z = 1 - u * height_, r = std::sqrt(std::max(0.0, 1 - z * z));
    const Vector w = r * std::cos(2 * material::kPi * v) * x_ + r * std::sin(2 * material::kPi * v) * y_ +
                     z * middle_.raw();
    return {normalized(assume<Direction>(w)), material::scaled(gain / density(), strength_), kFar};
  }

  // Density of sample() per steradian of a disc; 0 if other strategies cannot find the light.
  double density() const { return isDisc_ ? 1 / (2 * material::kPi * height_) : 0; }

  // Radiance at p from a direction.
  std::optional<Rgb> seen(const Point& p, const Direction& direction) const {
    if (!isDisc_ || (middle_ + -direction).raw().squaredNorm() / 2 >= height_) return std::nullopt;
    return material::scaled(capture::gainAt(gradient_, p.raw()), strength_);
  }

  // Octant of the light as seen from the origin; lamps of one octant may be traced in one packet.
  int octant() const {
    const Vector d = isPoint_ ? position_.raw() : middle_.raw();
    return (d[0] > 0) + 2 * (d[1] > 0) + 4 * (d[2] > 0);
  }

private:
  // 1 - cos(radius)
  static double capHeight(Angle radius) { return 2 * material::squared(std::sin(radius.radians() / 2)); }
  // Radiance of a disc that gives irradiance 1 to a surface facing it: 1 / (pi sin^2 radius).
  static double discRadiance(Angle radius) {
    return 1 / (material::kPi * material::squared(std::sin(radius.radians())));
  }

  double height_;
  bool isPoint_ = true, isDisc_ = false;
  Point position_;
  Direction middle_;
  Vector gradient_; // of the logarithm of strength
  Vector x_, y_;    // axes across a disc
  Rgb strength_;    // intensity; for distant lights, irradiance or radiance at the origin
};

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
