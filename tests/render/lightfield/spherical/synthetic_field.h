// A spherical light field of a bumpy sphere with closed-form radiance, in memory, without photographs.
#pragma once

#include "render/lightfield/spherical/build.h"
#include "render/lightfield/spherical/direction_tree.h"
#include "render/lightfield/spherical/reference.h"
#include "render/lightfield/spherical/spherical_file.h"
#include "srf/capture/camera.h"
#include "srf/image/half_float.h"
#include "surfel/geometry/ray_caster.h"
#include "tests/render/lightfield/common/bumpy_sphere.h"
#include "tests/support/random.h"

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace surflect::spherical {

using lightfield::bumpySphere;

// Radiance of a matte point.
inline Eigen::Vector3d painted(const Vec3<double>& p) {
  const double wave = 0.5 + 0.4 * std::sin(5 * p[0] + 1) * std::cos(4 * p[1] - 3 * p[2]);
  return {wave, 0.5 * wave, 0.3};
}

// A field in memory, with its truth.
class SyntheticField : public ImageSource {
public:
  SyntheticField(size_t levels, int size, double bump = 0.2)
      : mesh(bumpySphere(bump)), rays(mesh), tree(levels), shape{levels, size, sphereAround(mesh, size)} {
    for (ImageNumber image = 0; image < shape.images(); ++image)
      images.push_back(projected(tree.direction(image)));
  }

  PencilImage read(ImageNumber image) const override { return images[image]; }
  ShownImage shown(const Pencil& pencil) const {
    const ImageNumber image = imageOf(pencil);
    return {image, &images[image]};
  }

  PencilImage projected(const Vec3<double>& direction) const {
    using Point = Point3<AcquisitionSpace, double>;
    using Direction = Direction3<AcquisitionSpace, double>;
    const ImageAxes axes = axesOf(direction);
    std::vector<Texel> colors;
    std::vector<float> heights;
    std::vector<bool> hits;
    for (int y = 0; y < shape.size; ++y)
      for (int x = 0; x < shape.size; ++x) {
        const Vec3<double> start =
            pointOf(shape.sphere, axes, {(x + 0.5) / shape.size, (y + 0.5) / shape.size, 1});
        const auto hit = rays.firstHit(assume<Point>(start), assume<Direction>(Vec3<double>(-direction)));
        Texel texel{};
        if (hit) {
          const Eigen::Vector3d color = painted(start - hit->distance * direction);
          for (int channel = 0; channel < 3; ++channel)
            texel[static_cast<size_t>(channel)] = image::nearestHalf(static_cast<float>(color[channel]));
          texel[3] = image::nearestHalf(1);
        }
        colors.push_back(texel);
        heights.push_back(hit ? static_cast<float>(1 - hit->distance / (2 * shape.sphere.radius)) : 0.f);
        hits.push_back(hit.has_value());
      }
    return mipmapped(shape.size, std::move(colors), continuedHeights(heights, hits, shape.size));
  }

  // The object as it is, without alpha at its edges.
  image::Image truth(const capture::Camera<AcquisitionSpace>& camera) const {
    image::Image picture(camera.lens.width, camera.lens.height, 4);
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    for (int y = 0; y < picture.height; ++y)
      for (int x = 0; x < picture.width; ++x) {
        const auto direction =
            worldFromCamera(capture::rayThrough(camera.lens, {x + 0.5, y + 0.5})->direction);
        const auto hit = rays.firstHit(camera.center(), direction);
        if (!hit) continue;
        const Eigen::Vector3d color = painted(camera.center().raw() + hit->distance * direction.raw());
        for (int channel = 0; channel < 3; ++channel)
          picture.at(x, y)[static_cast<size_t>(channel)] = static_cast<float>(color[channel]);
        picture.at(x, y)[3] = 1;
      }
    return picture;
  }

  TriangleMesh mesh;
  RayCaster<AcquisitionSpace> rays;
  DirectionTree tree;
  FieldShape shape;
  std::vector<PencilImage> images;
};

// Looks from a point to the origin, with square pictures.
inline capture::Camera<AcquisitionSpace> cameraAt(const Vec3<double>& from, int size, double fovDeg = 35) {
  const Vec3<double> back = from.normalized();
  const Vec3<double> side = std::abs(back[1]) < 0.9 ? Vec3<double>(0, 1, 0) : Vec3<double>(0, 0, 1);
  const Vec3<double> right = side.cross(back).normalized();
  Mat3<double> rotation;
  rotation << right.transpose(), back.cross(right).transpose(), back.transpose();
  capture::Camera<AcquisitionSpace> camera;
  camera.lens.width = camera.lens.height = size;
  camera.lens.centerX = camera.lens.centerY = size / 2.0;
  camera.lens.focalX = camera.lens.focalY = size / 2.0 / std::tan(fovDeg * std::numbers::pi / 360);
  camera.cameraFromWorld = {rotation, -(rotation * from)};
  return camera;
}

// PSNR against a peak of 1, over the pixels that either picture covers.
inline double decibels(const image::Image& a, const image::Image& b) {
  double squares = 0, count = 0;
  for (size_t i = 0; i < a.values.size(); i += 4) {
    if (a.values[i + 3] == 0 && b.values[i + 3] == 0) continue;
    for (size_t channel = 0; channel < 4; ++channel, ++count)
      squares += std::pow(static_cast<double>(a.values[i + channel] - b.values[i + channel]), 2);
  }
  return -10 * std::log10(squares / count);
}

// Error over the pixels that both pictures cover fully.
inline double interiorDecibels(image::Image a, image::Image b) {
  for (size_t i = 3; i < a.values.size(); i += 4)
    if (!(a.values[i] > 0.99f && b.values[i] > 0.99f)) a.values[i] = b.values[i] = 0;
  return decibels(a, b);
}

} // namespace surflect::spherical
