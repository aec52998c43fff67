// A flat plate on z = 0 in front of one orthographic camera: where the errors of the look-up have a closed
// form.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/model/model.h"
#include "surfel/math/angle.h"

#include <filesystem>
#include <span>

namespace surflect::bench {

// Looks at the origin from above, leaning by `lean` towards +x; y is up on the picture, of which a side is
// 2 halfSide.
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

// Photographs of the plate by one camera, one a light; without lights one, under fixed illumination. Packs
// them on the square |x|, |y| <= halfSide at the height z into folder/model.srf.
model::Model packPlate(const std::filesystem::path& folder, const capture::Camera<AcquisitionSpace>& camera,
                       std::span<const capture::Light> lights, std::span<const image::Image> photographs,
                       double halfSide, double z, size_t surfels);

} // namespace surflect::bench
