// A capture with a closed-form truth: a Lambert sphere of radius 1 at the origin, photographed from all
// around under directional lights from all around.
#pragma once

#include "srf/capture/writer.h"
#include "srf/image/image.h"
#include "srf/model/model.h"
#include "srf/model/pack.h"
#include "tests/srf/image/files.h"

#include <cmath>
#include <functional>
#include <optional>

namespace surflect::studio {

inline constexpr double cameraDistance = 4;

// count unit vectors, evenly spread over the sphere.
std::vector<Vec3<double>> spiral(int count);

// Looks at the origin from the given direction; the sphere leaves a border of 7 of the size x size pixels.
template <class World> capture::Camera<World> cameraFrom(const Vec3<double>& direction, int size) {
  const Vec3<double> back = direction.normalized();
  const Vec3<double> right =
      (std::abs(back[1]) < 0.99 ? Vec3<double>(0, 1, 0) : Vec3<double>(0, 0, -1)).cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  capture::Camera<World> camera;
  camera.lens.width = camera.lens.height = size;
  camera.lens.centerX = camera.lens.centerY = size / 2.0;
  const double tangent = 1 / std::sqrt(cameraDistance * cameraDistance - 1); // of the sphere's angular radius
  camera.lens.focalX = camera.lens.focalY = (size / 2.0 - 7) / tangent;
  camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -cameraDistance)};
  return camera;
}

// Intersections of a camera's rays with the sphere: samples x samples rays per pixel, exact.
struct SphereView {
  int width = 0, height = 0;
  std::vector<Vec3<float>> normals; // pixel by pixel
  std::vector<uint32_t> first;      // of each pixel; one more, for the end
  image::Image alpha;               // share of the rays that meet the sphere
};

template <class World> SphereView viewSphere(const capture::Camera<World>& camera, int samples);

// The picture of a radiance that is a function of the unit normal, not multiplied by alpha.
using RadianceAt = std::function<Rgb(const Vec3<float>& normal)>;
image::Image shadeSphere(const SphereView& view, const RadianceAt& radianceAt);

// View of the sphere over black: RGBA, premultiplied.
inline image::Image overBlack(const SphereView& view, const RadianceAt& radianceAt) {
  return surflect::image::overBlack(shadeSphere(view, radianceAt), view.alpha);
}

// Radiance of a Lambert surface: albedo / pi  E  max(0, n . l).
Rgb lambert(Rgb albedo, Rgb irradiance, const Vec3<float>& n, const Vec3<float>& towards);

// Radiance of a white highlight: E max(0, n . h)^100, symmetric in light and viewer.
Rgb highlight(Rgb irradiance, const Vec3<float>& n, const Vec3<float>& towardsLight,
              const Vec3<float>& towardsView);

// A sphere of slices x slices/2 quads as ASCII PLY, corners on the unit sphere.
void writeSphereMesh(const std::filesystem::path& path, int slices = 96);

inline std::string numbered(const char* prefix, size_t number) {
  return std::string(prefix).append(std::to_string(number));
}

struct Studio {
  int cameras = 14;
  int lights = 20; // 0: fixed illumination, of radiance fixedRadiance
  int size = 40;   // of pictures, pixels
  int samples = 3; // see SphereView
  Rgb albedo{0.8f, 0.5f, 0.3f};
  float gloss = 0;       // brightness of highlights (highlight)
  bool matte = true;     // pictures have alpha
  float opacity = 1;     // alpha of the sphere
  double unevenness = 0; // how much the logarithm of each light's irradiance changes over a radius
  // split of a frame; none: the frame is left out
  std::function<std::optional<capture::Split>(size_t view, size_t light)> split = [](size_t, size_t) {
    return std::optional(capture::Split::train);
  };
};

inline Rgb fixedRadiance(const Vec3<float>& n) { return (0.6f + 0.4f * n[1]) * Rgb{0.9f, 0.7f, 0.2f}; }

// Lights of different strengths, with strengths that rise along different directions. Results must not depend
// on either.
std::vector<capture::Light> studioLights(int count, double unevenness = 0);

// Writes transforms.json, mesh.ply and one EXR a camera.
capture::Capture photograph(const Studio& studio, const std::filesystem::path& folder);

// photograph(), with a transforms.json that does not name the mesh.
capture::Capture photographWithoutMesh(const Studio& studio, const std::filesystem::path& folder);

// Studio without about a third of its frames; every camera has some.
inline Studio gappyStudio() {
  return {.split = [](size_t view, size_t light) {
    return (view * 7 + light * light * 5) % 3 == 0 ? std::nullopt : std::optional(capture::Split::train);
  }};
}

// Without tables, which take longer than all else.
inline model::PackOptions packOptions(size_t surfels, double tolerance = 0.005) {
  model::PackOptions options;
  options.surfels = surfels;
  options.tolerance = tolerance;
  options.tables = false;
  return options;
}

// A studio, photographed and packed, for as long as this lives.
class PackedStudio {
public:
  explicit PackedStudio(const Studio& studio, size_t surfels = 3000)
      : PackedStudio(studio, packOptions(surfels)) {}
  PackedStudio(const Studio& studio, const model::PackOptions& options)
      : capture(photograph(studio, folder / "capture")),
        report(model::pack(capture, folder / "model", options, {}, nullptr)),
        model(model::openModel(folder / "model")) {}

  image::TemporaryFolder folder;
  capture::Capture capture;
  model::PackReport report;
  model::Model model;
};

} // namespace surflect::studio
