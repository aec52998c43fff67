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
#include <numbers>
#include <optional>
#include <sstream>

namespace surflect::studio {

inline constexpr double cameraDistance = 4;

// count unit vectors, evenly spread over the sphere.
inline std::vector<Vec3<double>> spiral(int count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3<double>> directions;
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - y * y);
    directions.emplace_back(r * std::cos(golden * i), y, r * std::sin(golden * i));
  }
  return directions;
}

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

template <class World> SphereView viewSphere(const capture::Camera<World>& camera, int samples) {
  SphereView view{camera.lens.width, camera.lens.height, {}, {0}, {}};
  view.alpha = image::Image(view.width, view.height, 1);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const auto traced = [&](capture::Pixel pixel) -> std::optional<Vec3<double>> {
    const auto ray = capture::rayThrough(camera.lens, pixel);
    const Vec3<double> o = worldFromCamera(ray->origin).raw(), d = worldFromCamera(ray->direction).raw();
    const double b = o.dot(d), discriminant = b * b - o.squaredNorm() + 1;
    if (discriminant < 0) return std::nullopt;
    return Vec3<double>(o + (-b - std::sqrt(discriminant)) * d);
  };
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      for (int s = 0; s < samples * samples; ++s)
        if (const std::optional<Vec3<double>> hit =
                traced({x + (s % samples + 0.5) / samples, y + (s / samples + 0.5) / samples}))
          view.normals.push_back(hit->cast<float>());
      const auto hits = static_cast<uint32_t>(view.normals.size()) - view.first.back();
      view.alpha.at(x, y)[0] = static_cast<float>(hits) / static_cast<float>(samples * samples);
      view.first.push_back(static_cast<uint32_t>(view.normals.size()));
    }
  return view;
}

// The picture of a radiance that is a function of the unit normal, not multiplied by alpha.
template <class RadianceAt> image::Image shadeSphere(const SphereView& view, const RadianceAt& radianceAt) {
  image::Image image(view.width, view.height, 3);
  for (size_t pixel = 0; pixel + 1 < view.first.size(); ++pixel) {
    const uint32_t begin = view.first[pixel], end = view.first[pixel + 1];
    Rgb sum;
    for (uint32_t i = begin; i < end; ++i) sum = sum + radianceAt(view.normals[i]);
    if (end > begin) sum = 1 / static_cast<float>(end - begin) * sum;
    std::ranges::copy(std::array{sum.r, sum.g, sum.b}, &image.values[3 * pixel]);
  }
  return image;
}

// View of the sphere over black: RGBA, premultiplied.
template <class RadianceAt> image::Image overBlack(const SphereView& view, const RadianceAt& radianceAt) {
  return surflect::image::overBlack(shadeSphere(view, radianceAt), view.alpha);
}

// Radiance of a Lambert surface: albedo / pi  E  max(0, n . l).
inline Rgb lambert(Rgb albedo, Rgb irradiance, const Vec3<float>& n, const Vec3<float>& towards) {
  return std::max(0.f, n.dot(towards)) / std::numbers::pi_v<float> * (albedo * irradiance);
}

// Radiance of a white highlight: E max(0, n . h)^100, symmetric in light and viewer.
inline Rgb highlight(Rgb irradiance, const Vec3<float>& n, const Vec3<float>& towardsLight,
                     const Vec3<float>& towardsView) {
  const float facing = std::min(n.dot(towardsLight), n.dot(towardsView));
  const Vec3<float> half = (towardsLight + towardsView).normalized();
  return facing > 0
             ? std::max(0.f, n.dot(towardsLight)) * std::pow(std::max(0.f, n.dot(half)), 100.f) * irradiance
             : Rgb{};
}

// A sphere of slices x slices/2 quads as ASCII PLY, corners on the unit sphere.
inline void writeSphereMesh(const std::filesystem::path& path, int slices = 96) {
  const int stacks = slices / 2;
  std::ostringstream ply;
  ply << "ply\nformat ascii 1.0\nelement vertex " << (stacks + 1) * slices
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << stacks * slices
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (int j = 0; j <= stacks; ++j)
    for (int i = 0; i < slices; ++i) {
      const double theta = std::numbers::pi * j / stacks, phi = 2 * std::numbers::pi * i / slices;
      ply << std::sin(theta) * std::cos(phi) << ' ' << std::cos(theta) << ' '
          << -std::sin(theta) * std::sin(phi) << '\n';
    }
  for (int j = 0; j < stacks; ++j)
    for (int i = 0; i < slices; ++i) {
      const int next = (i + 1) % slices;
      ply << "4 " << j * slices + i << ' ' << (j + 1) * slices + i << ' ' << (j + 1) * slices + next << ' '
          << j * slices + next << '\n';
    }
  image::writeBytes(path, ply.str());
}

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
inline std::vector<capture::Light> studioLights(int count, double unevenness = 0) {
  const std::vector<Vec3<double>> rises = spiral(2 * count);
  std::vector<capture::Light> lights;
  for (const Vec3<double>& towards : spiral(count)) {
    const size_t i = lights.size();
    const auto level = static_cast<float>(1 + i % 3);
    lights.push_back({numbered("L", i), numbered("L", i),
                      capture::DirectionalLight{assume<Direction3<AcquisitionSpace, double>>(towards),
                                                {level, 2 * level, 3},
                                                unevenness * rises[(7 * i + 3) % rises.size()]}});
  }
  return lights;
}

// Writes transforms.json, mesh.ply and one EXR a camera.
inline capture::Capture photograph(const Studio& studio, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  writeSphereMesh(folder / "mesh.ply");
  capture::Capture capture;
  capture.file = folder / "transforms.json";
  capture.colorSpace = capture::ColorSpace::linear;
  capture.geometry = "mesh.ply";
  capture.lights = studioLights(studio.lights, studio.unevenness);
  const auto shots = static_cast<size_t>(std::max(studio.lights, 1));
  for (const Vec3<double>& direction : spiral(studio.cameras)) {
    const size_t v = capture.views.size();
    const capture::View& view = capture.views.emplace_back(
        capture::View{numbered("C", v), cameraFrom<AcquisitionSpace>(direction, studio.size)});
    SphereView sphere = viewSphere(view.camera, studio.samples);
    for (float& alpha : sphere.alpha.values) alpha *= studio.opacity;
    const std::string picture = numbered("C", v) + ".exr";
    std::vector<image::Image> images(shots);
    std::vector<capture::RadianceLayer> layers;
    for (size_t l = 0; l < shots; ++l) {
      const auto split = studio.split(v, l);
      if (!split) continue;
      capture::Frame frame;
      frame.view = v;
      frame.picture = picture;
      frame.layer = numbered("L", l);
      if (studio.matte) frame.alphaLayer = "matte";
      frame.split = *split;
      images[l] = shadeSphere(sphere, fixedRadiance);
      if (studio.lights > 0) {
        frame.light = l;
        const capture::Light& light = capture.lights[l];
        const Vec3<float> towards = capture::towardsLight(light, {0, 0, 0}).raw().cast<float>();
        const Vec3<float> eye = (cameraDistance * direction).cast<float>();
        images[l] = shadeSphere(sphere, [&](const Vec3<float>& n) {
          const auto place = assume<Point3<AcquisitionSpace, double>>(n.cast<double>());
          const Rgb irradiance = capture::irradianceAt(light, place);
          const Rgb diffuse = lambert(studio.albedo, irradiance, n, towards);
          if (studio.gloss == 0) return diffuse;
          return diffuse + studio.gloss * highlight(irradiance, n, towards, (eye - n).normalized());
        });
      }
      layers.push_back({frame.layer, &images[l]});
      capture.frames.push_back(frame);
    }
    capture::writeViewPictures(folder / picture, layers, studio.matte ? &sphere.alpha : nullptr, "matte");
  }
  capture::writeCapture(capture, folder);
  return capture;
}

// photograph(), with a transforms.json that does not name the mesh.
inline capture::Capture photographWithoutMesh(const Studio& studio, const std::filesystem::path& folder) {
  capture::Capture capture = photograph(studio, folder);
  capture.geometry.clear();
  capture::writeCapture(capture, folder);
  return capture;
}

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
