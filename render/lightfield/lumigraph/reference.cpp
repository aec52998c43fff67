#include "render/lightfield/lumigraph/reference.h"

#include "render/lightfield/lumigraph/reconstruction.h"

#include <algorithm>

namespace surflect::lumigraph {

Reference::Reference(const Lumigraph& lumigraph)
    : lumigraph_(lumigraph), geometry_(lumigraph.geometry.mesh), fringe_(lumigraph.geometry.fringe) {}

image::Image Reference::render(const capture::Camera<AcquisitionSpace>& camera,
                               const Progress& progress) const {
  image::Image picture(camera.lens.width, camera.lens.height, 4);
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  const Point viewer = camera.center();
  for (int y = 0; y < picture.height; ++y) {
    progress.checkpoint();
    for (int x = 0; x < picture.width; ++x) {
      const auto ray = capture::rayThrough(camera.lens, {x + 0.5, y + 0.5});
      if (!ray) continue;
      const Direction direction = worldFromCamera(ray->direction);
      auto hit = geometry_.firstHit(viewer, direction);
      if (!hit) hit = fringe_.firstHit(viewer, direction);
      if (!hit) continue;
      const Eigen::Vector4d color = radianceAt(lumigraph_, viewer + hit->distance * direction, viewer);
      std::ranges::copy(color.cast<float>(), picture.at(x, y).begin());
    }
  }
  return picture;
}

} // namespace surflect::lumigraph
