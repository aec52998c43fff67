// A flat plate at z = 0 in front of one orthographic camera, for which errors of the look-up have a closed
// form.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/model/model.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <span>

namespace surflect::bench {

// Camera that looks at the origin from above, tilted by `lean` towards +x, with y up in the picture, whose
// sides measure 2 halfSide.
template <class World> capture::Camera<World> cameraAbove(Angle lean, int size, double halfSide) {
  const double s = std::sin(lean.radians()), c = std::cos(lean.radians());
  capture::Camera<World> camera;
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.lens.width = camera.lens.height = size;
  camera.lens.focalX = camera.lens.focalY = size / (2 * halfSide);
  camera.lens.centerX = camera.lens.centerY = size / 2.0;
  Mat3<double> rotation; // rows: right, up, back
  rotation << c, 0, -s, 0, 1, 0, s, 0, c;
  camera.cameraFromWorld = {rotation, Vec3<double>(0, 0, -10)};
  return camera;
}

// Packs photographs of the plate by one camera, one for each light (or a single one under fixed illumination
// without lights), as folder/model.srf. The impostor is the square |x|, |y| <= halfSide at height z.
model::Model packPlate(const std::filesystem::path& folder, const capture::Camera<AcquisitionSpace>& camera,
                       std::span<const capture::Light> lights, std::span<const image::Image> photographs,
                       double halfSide, double z, size_t surfels);

} // namespace surflect::bench
