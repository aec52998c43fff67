#include "render/lightfield/spherical/reference.h"

#include "render/lightfield/spherical/pencil_weights.h"
#include "render/lightfield/spherical/reprojection.h"
#include "render/lightfield/spherical/visible_pencils.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::spherical {

namespace {

// Sums over the pencils of a level that show a ray.
struct RaySum {
  Eigen::Vector4d color = Eigen::Vector4d::Zero();
  double depth = 0; // times alpha
  double weight = 0;
};

struct Ray {
  Vec3<double> origin, direction; // unit
  double alongAxis;               // of the direction
};

// A pencil with its weight.
struct Projection {
  const PencilImage& image;
  const ImageAxes& axes;
  const Sphere& sphere;
  double mip, weight;
};

void addPlane(const Projection& pencil, const Ray& ray, RaySum& sum) {
  const Vec3<double> e = placeOf(pencil.sphere, pencil.axes, ray.origin),
                     w = vectorOf(pencil.sphere, pencil.axes, ray.direction);
  if (!(e[2] > 0 && w[2] < 0)) return;
  const Vec2<double> plane = atPlane(e, w);
  if (!passesSphere(e, plane, slopeOf(w))) return;
  if (plane.minCoeff() < 0 || plane.maxCoeff() > 1) return;
  const Eigen::Vector4d color = pencil.weight * colorAt(pencil.image, plane, pencil.mip);
  sum.color += color;
  sum.depth += color[3] * e[2] / -w[2] * ray.alongAxis;
}

void addPoint(const Projection& pencil, const Vec3<double>& point, RaySum& sum) {
  const Vec3<double> place = placeOf(pencil.sphere, pencil.axes, point);
  const Eigen::Vector4d color = colorAt(pencil.image, place.head<2>(), pencil.mip);
  const double shown = visibility(pencil.image, place, pencil.mip) * weightOfAlpha(color[3]);
  const double weight = pencil.weight * std::max(kHidden, shown);
  sum.color += weight * color;
  sum.weight += weight;
}

} // namespace

Picture renderReference(const DirectionTree& tree, const FieldShape& shape, const ShownImageOf& imageOf,
                        const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                        const RayCaster<AcquisitionSpace>& surface, const Progress& progress) {
  windowOf(camera, shape.sphere); // refuses cameras
  Picture picture{image::Image(camera.lens.width, camera.lens.height, 4),
                  image::Image(camera.lens.width, camera.lens.height, 1)};
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const Vec3<double> viewer = camera.center().raw();
  const double focal = std::min(camera.lens.focalX, camera.lens.focalY);
  const double distance = (viewer - shape.sphere.middle).norm();
  const double mip = std::max(look.mip, look.coarser + mipFor(shape.sphere, shape.size, distance, 1 / focal));
  for (int y = 0; y < picture.color.height; ++y) {
    progress.checkpoint();
    for (int x = 0; x < picture.color.width; ++x) {
      const auto inCamera = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5})->direction;
      const Ray ray{viewer, worldFromCamera(inCamera).raw(), -inCamera.z()};
      const auto hit =
          look.depth ? surface.firstHit(camera.center(), worldFromCamera(inCamera)) : std::nullopt;
      Eigen::Vector4d color = Eigen::Vector4d::Zero();
      double depth = 0; // times alpha
      for (const LevelShare& level : levelShares(look.detail, shape.levels)) {
        RaySum sum;
        for (const PencilShare& share : pencilShares(tree, level.level, -ray.direction, look.interpolated)) {
          const ShownImage shown = imageOf(share.pencil);
          const ImageAxes axes = axesOf(tree.direction(shown.number));
          const Projection pencil{*shown.image, axes, shape.sphere, mip, share.weight};
          if (!look.depth)
            addPlane(pencil, ray, sum);
          else if (hit)
            addPoint(pencil, viewer + hit->distance * ray.direction, sum);
        }
        if (sum.weight > 0) {
          sum.color /= sum.weight;
          sum.depth = sum.color[3] * hit->distance * ray.alongAxis;
        }
        color += level.weight * sum.color;
        depth += level.weight * sum.depth;
      }
      std::ranges::copy(color.cast<float>(), picture.color.at(x, y).begin());
      picture.depth.at(x, y)[0] =
          color[3] > 0 ? static_cast<float>(depth / color[3]) : std::numeric_limits<float>::infinity();
    }
  }
  return picture;
}

} // namespace surflect::spherical
