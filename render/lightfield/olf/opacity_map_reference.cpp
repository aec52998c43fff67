#include "render/lightfield/olf/opacity_map_reference.h"

#include "render/lightfield/lfm/tile.h"

namespace surflect::olf {

ReferencePicture referencePicture(const OpacityMaps& maps, const capture::Camera<AcquisitionSpace>& camera,
                                  std::optional<size_t> terms) {
  const OpacityMaps plain{lfm::decoded(maps.maps), maps.white, maps.order};
  return composited(plain.maps.mesh, camera, [&](const FrontHit& hit, const Vec3<double>& direction) {
    const lfm::TrianglePlace place{hit.triangle, hit.barycentric[1], hit.barycentric[2]};
    return colorAt(plain, place, assume<lfm::Direction>(Vec3<double>(-direction.normalized())),
                   terms.value_or(lfm::kMostTerms));
  });
}

} // namespace surflect::olf
