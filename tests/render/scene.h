// Scenes of coloured surfels, and their pictures.
#pragma once

#include "render/splat/splat_raster.h"
#include "tests/render/clouds.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace surflect::testing {

using V3 = Vec3<double>;

struct Scene {
  SurfelCloud rest;
  DeformedCloud cloud;
  std::vector<float> colors; // RGB

  splat::Splats splats() const { return splat::splatsOf(rest, cloud); }

  // color: of a surfel at its deformed position
  template <class Color> void add(const SurfelCloud& more, const Warp& warp, Color color) {
    const DeformedCloud warped = deformed(more, warp);
    append(rest, cloud, more, warped);
    for (const auto& p : warped.p) {
      const V3 c = color(V3(p.raw().cast<double>()));
      for (int k = 0; k < 3; ++k) colors.push_back(static_cast<float>(c[k]));
    }
  }
};

inline V3 unmoved(const V3& p) { return p; }
inline auto constant(const V3& color) {
  return [color](const V3&) { return color; };
}
inline const V3 red(1, 0, 0), green(0, 1, 0);

inline std::vector<float> ofVisible(const splat::SplatRaster& coverage, const std::vector<float>& colors) {
  std::vector<float> values;
  for (const uint32_t i : coverage.visible)
    for (size_t k = 0; k < 3; ++k) values.push_back(colors[3 * size_t{i} + k]);
  return values;
}

// cover and blend, with alpha as fourth channel.
inline image::Image rendered(const Scene& scene, const capture::Camera<ObjectSpace>& camera,
                             const splat::SplatOptions& options = {}) {
  const splat::SplatRaster coverage = splat::rasterize(camera, scene.splats(), options);
  return splat::blendWithAlpha(coverage, ofVisible(coverage, scene.colors), 3);
}

// A sphere of many surfels before a plane, in smooth colours.
inline Scene sphereBeforePlane(Rng& rng) {
  const auto smooth = [](const V3& p) {
    return V3(0.5 + 0.4 * std::sin(2 * p[0]), 0.5 + 0.3 * p[1], 0.4 - 0.2 * p[2]);
  };
  Scene scene;
  scene.add(unitSphere(6000, rng), unmoved, smooth);
  scene.add(
      sheet(2, 2, 0.06, 0.1, rng), [](const V3& p) { return V3(p + V3(0, 0, -1.5)); }, smooth);
  return scene;
}

} // namespace surflect::testing
