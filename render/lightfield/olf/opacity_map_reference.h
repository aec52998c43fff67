// Pictures of opacity light field maps in double precision: every triangle that the ray of a pixel's centre
// meets from its front, in the exact order of depths.
#pragma once

#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/reference.h"
#include "srf/capture/camera.h"

#include <cstddef>
#include <optional>

namespace surflect::olf {

// c = sum_i c_i prod_{j < i} (1 - alpha_j), with colorAt() of the first `terms` terms. Triangles at equal
// depth are in the order of the mesh. The camera is a plain pinhole. Maps may be compressed.
ReferencePicture referencePicture(const OpacityMaps& maps, const capture::Camera<AcquisitionSpace>& camera,
                                  std::optional<size_t> terms = {});

} // namespace surflect::olf
