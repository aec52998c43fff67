#include "render/lightfield/lfm/reference.h"

#include "render/lightfield/common/front_hit.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"

#include <tbb/parallel_for.h>

#include <utility>

namespace surflect::lfm {

Reference::Reference(LightFieldMaps maps, const Progress& progress)
    : maps_(decoded(std::move(maps))), rays_(maps_.mesh, progress) {}

image::Image Reference::render(const capture::Camera<AcquisitionSpace>& camera, std::optional<size_t> terms,
                               const Progress& progress) const {
  const capture::Lens& lens = camera.lens;
  const auto worldFromCamera = camera.cameraFromWorld.inverse();
  image::Image picture(lens.width, lens.height, 4);
  tbb::parallel_for(0, lens.height, [&](int y) {
    progress.checkpoint();
    for (int x = 0; x < lens.width; ++x) {
      const auto ray = capture::rayThrough(lens, {x + 0.5, y + 0.5});
      if (!ray) continue;
      const Direction direction = normalized(worldFromCamera(ray->direction));
      const auto hit = lightfield::firstFrontHit(maps_.mesh, rays_, worldFromCamera(ray->origin), direction);
      if (!hit) continue;
      const Vec3<double> radiance =
          radianceAt(maps_, {hit->triangle, hit->b, hit->c}, -direction, terms.value_or(maps_.terms.size()));
      for (size_t channel = 0; channel < 3; ++channel)
        picture.at(x, y)[channel] = static_cast<float>(radiance[static_cast<Eigen::Index>(channel)]);
      picture.at(x, y)[3] = 1;
    }
  });
  return picture;
}

} // namespace surflect::lfm
