#include "render/lightfield/spherical/reference.h"

#include "render/lightfield/spherical/pencil_weights.h"
#include "render/lightfield/spherical/reprojection.h"
#include "render/lightfield/spherical/visible_pencils.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace surflect::spherical {

namespace {

// Sums over the pencils that show a ray.
struct RaySum {
  Eigen::Vector4d color = Eigen::Vector4d::Zero();
  double depth = 0; // times alpha
};

struct Ray {
  Vec3<double> origin, direction; // unit
  double alongAxis;               // of the direction
};

void addPencil(const ShownImage& shown, const ImageAxes& axes, const Sphere& sphere, const Ray& ray,
               const Look& look, double mip, double weight, RaySum& sum) {
  const Vec3<double> e = placeOf(sphere, axes, ray.origin), w = vectorOf(sphere, axes, ray.direction);
  if (!(e[2] > 0 && w[2] < 0)) return;
  const Vec2<double> plane = atPlane(e, w), slope = slopeOf(e, plane);
  if (!passesSphere(e, plane, slope)) return;
  const std::optional<double> height =
      look.depth ? heightMet(*shown.image, plane, slope, e[2], mip) : std::optional(0.0);
  if (!height) return;
  const Vec2<double> place = plane + *height * slope;
  if (place.minCoeff() < 0 || place.maxCoeff() > 1) return;
  const Eigen::Vector4d color = weight * colorAt(*shown.image, place, mip);
  sum.color += color;
  sum.depth += color[3] * (e[2] - *height) / -w[2] * ray.alongAxis;
}

} // namespace

Picture renderReference(const DirectionTree& tree, const FieldShape& shape, const ShownImageOf& imageOf,
                        const capture::Camera<AcquisitionSpace>& camera, const Look& look,
                        const Progress& progress) {
  windowOf(camera, shape.sphere); // refuses cameras
  Picture picture{image::Image(camera.lens.width, camera.lens.height, 4),
                  image::Image(camera.lens.width, camera.lens.height, 1)};
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const Vec3<double> viewer = camera.center().raw();
  const double focal = std::min(camera.lens.focalX, camera.lens.focalY);
  const double mip =
      std::max(look.mip, mipFor(shape.sphere, shape.size, (viewer - shape.sphere.middle).norm(), 1 / focal));
  for (int y = 0; y < picture.color.height; ++y) {
    progress.checkpoint();
    for (int x = 0; x < picture.color.width; ++x) {
      const auto inCamera = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5})->direction;
      const Ray ray{viewer, worldFromCamera(inCamera).raw(), -inCamera.z()};
      RaySum sum;
      for (const LevelShare& level : levelShares(look.detail, shape.levels))
        for (const PencilShare& share : pencilShares(tree, level.level, -ray.direction, look.interpolated)) {
          const ShownImage shown = imageOf(share.pencil);
          addPencil(shown, axesOf(tree.direction(shown.number)), shape.sphere, ray, look, mip,
                    level.weight * share.weight, sum);
        }
      std::ranges::copy(sum.color.cast<float>(), picture.color.at(x, y).begin());
      picture.depth.at(x, y)[0] = sum.color[3] > 0 ? static_cast<float>(sum.depth / sum.color[3])
                                                   : std::numeric_limits<float>::infinity();
    }
  }
  return picture;
}

} // namespace surflect::spherical
