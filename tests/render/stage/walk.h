// Slow reference for the tracer: one ray at a time, without light sampling. Light is found only by paths that
// hit it, so lights need an extent.
#pragma once

#include "render/stage/stage_scene.h"
#include "tests/render/stage/stages.h"

#include <functional>

namespace surflect::stage {

using EnvironmentRadiance = std::function<double(const StageDirection&)>;

// Radiance, in red, that comes along the ray to its origin. Surfaces are shown as they are: normals are those
// of the triangles where these are flat.
inline double walk(const StageScene& scene, StagePoint origin, StageDirection direction,
                   const EnvironmentRadiance& environment, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  double throughput = 1, absorption = 0;
  for (int bounce = 0;; ++bounce) {
    auto hit = scene.firstHit(origin, direction);
    if (!hit) return bounce > 0 ? throughput * environment(direction) : 0;
    throughput *= std::exp(-absorption * hit->distance);
    const auto* glass = std::get_if<material::Dielectric>(&hit->material);
    Vec3<double> z = hit->normal.raw().normalized();
    if (!glass && z.dot(direction.raw()) > 0) z = -z;
    Vec3<double> x = hit->tangent.raw() - hit->tangent.raw().dot(z) * z;
    x = x.norm() > 0 ? x.normalized() : z.unitOrthogonal();
    const Vec3<double> y = z.cross(x), back = -direction.raw();
    const double u = uniform(random), v = uniform(random), w = uniform(random);
    const auto s = material::sample(hit->material, {x.dot(back), y.dot(back), z.dot(back)}, {u, v, w});
    if (!s || bounce > 1000) return 0;
    throughput *= double{s->weight.r};
    if (throughput < 0.1) {
      if (uniform(random) < 0.5) return 0;
      throughput *= 2;
    }
    direction = assume<StageDirection>((s->wi.x() * x + s->wi.y() * y + s->wi.z() * z).normalized());
    if (glass) absorption = s->wi.z() < 0 ? glass->absorption.r : glass->absorptionOutside.r;
    origin = scene.leaving(*hit, direction);
  }
}

// Mean over samples, and the standard error of that mean.
struct Estimate {
  double mean = 0, error = 0;
};

inline Estimate estimateOf(int count, const std::function<double()>& draw) {
  double sum = 0, squares = 0;
  for (int i = 0; i < count; ++i) {
    const double value = draw();
    sum += value;
    squares += value * value;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean) / (count - 1))};
}

} // namespace surflect::stage
