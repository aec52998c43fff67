#include "srf/model/matted_view.h"
#include "srf/capture/silhouette.h"

#include <algorithm>

namespace surflect::model {

namespace {

void matteFromMesh(MattedView& view, const capture::Camera<AcquisitionSpace>& camera,
                   const RayCaster<AcquisitionSpace>& impostor) {
  constexpr int kRim = 2; // pixels
  view.stack.alpha = capture::silhouette(camera, impostor);
  const image::Mask outline = image::objectMask(view.stack.alpha);
  view.object = image::eroded(outline, kRim);
  const auto source = image::nearestSeeds(view.object, outline);
  for (image::Image& light : view.stack.lights)
    for (size_t texel = 0; texel < source.size(); ++texel)
      if (source[texel] != texel)
        std::copy_n(light.values.begin() + static_cast<std::ptrdiff_t>(3 * source[texel]), 3,
                    light.values.begin() + static_cast<std::ptrdiff_t>(3 * texel));
}

} // namespace

MattedView fillMissingMatte(ViewPictures pictures, const capture::Camera<AcquisitionSpace>& camera,
                            const RayCaster<AcquisitionSpace>& impostor) {
  MattedView view{std::move(pictures.stack), {}, pictures.invalidTexels};
  if (pictures.hasMatte)
    view.object = image::objectMask(view.stack.alpha);
  else
    matteFromMesh(view, camera, impostor);
  return view;
}

} // namespace surflect::model
