#include "tests/support/synthetic_capture.h"

#include <numbers>
#include <sstream>

namespace surflect::studio {

std::vector<Vec3<double>> spiral(int count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3<double>> directions;
  for (int i = 0; i < count; ++i) {
    const double y = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - y * y);
    directions.emplace_back(r * std::cos(golden * i), y, r * std::sin(golden * i));
  }
  return directions;
}

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

template SphereView viewSphere(const capture::Camera<AcquisitionSpace>&, int);
template SphereView viewSphere(const capture::Camera<ObjectSpace>&, int);

image::Image shadeSphere(const SphereView& view, const RadianceAt& radianceAt) {
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

Rgb lambert(Rgb albedo, Rgb irradiance, const Vec3<float>& n, const Vec3<float>& towards) {
  return std::max(0.f, n.dot(towards)) / std::numbers::pi_v<float> * (albedo * irradiance);
}

Rgb highlight(Rgb irradiance, const Vec3<float>& n, const Vec3<float>& towardsLight,
              const Vec3<float>& towardsView) {
  const float facing = std::min(n.dot(towardsLight), n.dot(towardsView));
  const Vec3<float> half = (towardsLight + towardsView).normalized();
  return facing > 0
             ? std::max(0.f, n.dot(towardsLight)) * std::pow(std::max(0.f, n.dot(half)), 100.f) * irradiance
             : Rgb{};
}

void writeSphereMesh(const std::filesystem::path& path, int slices) {
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

std::vector<capture::Light> studioLights(int count, double unevenness) {
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

capture::Capture photograph(const Studio& studio, const std::filesystem::path& folder) {
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

capture::Capture photographWithoutMesh(const Studio& studio, const std::filesystem::path& folder) {
  capture::Capture capture = photograph(studio, folder);
  capture.geometry.clear();
  capture::writeCapture(capture, folder);
  return capture;
}

} // namespace surflect::studio
