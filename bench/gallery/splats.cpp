#include "bench/gallery/figures.h"

#include "render/film/frame_file.h"
#include "render/surfels/develop.h"
#include "render/surfels/frame.h"
#include "warp/deform.h"

namespace surflect::bench {

namespace {

constexpr int kSide = 20; // surfels along a side of the grid
constexpr float kSpacing = 1.f / kSide;

SurfelCloud squareGrid() {
  SurfelCloud cloud;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const float x = (static_cast<float>(i) + 0.5f) * kSpacing - 0.5f,
                  y = (static_cast<float>(j) + 0.5f) * kSpacing - 0.5f;
      cloud.p0.emplace_back(x, y, 0.f);
      cloud.r0.push_back(rodriguesOf(Normal3<AcquisitionSpace>(0, 0, 1)));
    }
  estimateSplats(cloud);
  return cloud;
}

// Checkerboard with a diagonal stripe.
Rgb colorAt(const Point3<AcquisitionSpace>& p) {
  const bool even = (std::lround(std::floor(p.x() * 4)) + std::lround(std::floor(p.y() * 4))) % 2 == 0;
  if (std::abs(p.x() + p.y() - 0.1f) < 0.09f) return {0.85f, 0.12f, 0.06f};
  return even ? Rgb{0.85f, 0.75f, 0.5f} : Rgb{0.1f, 0.25f, 0.45f};
}

// Splats that keep their circular rest shape but lie in the tangent planes of the deformed surface.
DeformedCloud circular(DeformedCloud cloud) {
  for (size_t i = 0; i < cloud.size(); ++i) {
    const auto frame = polarFrame<float>(cloud.u[i].raw(), cloud.v[i].raw());
    cloud.u[i] = assume<Direction3<ObjectSpace>>(frame->u);
    cloud.v[i] = assume<Direction3<ObjectSpace>>(frame->v);
  }
  return cloud;
}

// Splats enlarged by `size` and with the given peak coverage.
SurfelCloud alone(SurfelCloud cloud, float size, float coverage) {
  for (float& radius : cloud.radius) radius *= size;
  std::ranges::fill(cloud.coverage, coverage);
  return cloud;
}

} // namespace

void drawSplats(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const SurfelCloud rest = squareGrid();
  std::vector<warp::WarpPointer> links;
  links.push_back(warp::rigidWarp({0, 0, 1}, Angle::fromDegrees(25), {0, 0, 0}, {0, 0, 0}));
  links.push_back(warp::scaleWarp({5, 1, 1}, {0, 0, 0}));
  const DeformedCloud ellipses = warp::deform(rest, *warp::chainWarp(std::move(links)));

  capture::Camera<ObjectSpace> camera; // from above; the middle of the patch fills the picture
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.lens.width = camera.lens.height = 300;
  camera.lens.focalX = camera.lens.focalY = 300 / 0.9;
  camera.lens.centerX = camera.lens.centerY = 150;
  camera.cameraFromWorld = {Mat3<double>::Identity(), Vec3<double>(0, 0, -10)};

  const auto draw = [&](const char* name, const SurfelCloud& cloud, const DeformedCloud& deformed) {
    const splat::SplatRaster coverage = surfels::look(camera, cloud, deformed);
    shading::Shaded shaded;
    for (const uint32_t surfel : coverage.visible) shaded.radiance.push_back(colorAt(cloud.p0[surfel]));
    film::writeFrame(folder / name, {surfels::developRadiance(coverage, shaded), {}}, {});
  };
  const DeformedCloud circles = circular(ellipses);
  draw("circular-reduced.exr", alone(rest, 0.3f, 2), circles);
  draw("elliptical-reduced.exr", alone(rest, 0.3f, 2), ellipses);
  draw("circular.exr", alone(rest, 1, 1), circles);
  draw("elliptical.exr", rest, ellipses);
}

} // namespace surflect::bench
