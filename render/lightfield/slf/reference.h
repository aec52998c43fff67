// Surface light field by rays, in double precision: what the OpenGL renderer is measured against.
//
// [Azuma 1999, §2.2]: the colour of a pixel is the sum over i of B_i(r) F_i(s). Symbols: p the point where
// the pixel's ray meets the front of the surface, r the direction from p to the viewer, s the texture
// coordinates of p.
#pragma once

#include "render/lightfield/slf/field.h"
#include "srf/capture/camera.h"
#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::slf {

// Bilinear interpolation between texel centres, constant beyond the outermost. `place` is in texels:
// (0, 0) is the corner of the first texel.
Eigen::Vector4d texelAt(std::span<const Texel> texels, int width, int height, const Vec2<double>& place);

class Reference {
public:
  // Field and textures must outlive the reference. Throws Error where the mesh does not fit into memory, and
  // Cancelled.
  Reference(const Field& field, const Textures& textures, const Progress& progress = {});

  // Place where a ray meets the front of the surface, with the hat functions of the direction back to it.
  struct Hit {
    uint32_t region = 0;
    Vec2<double> place = {0, 0}; // in the region's textures, texels
    double distance = 0;         // along the unit direction
    HatWeights hats;
  };
  std::optional<Hit> firstHit(const Point3<AcquisitionSpace, double>& origin,
                              const Direction3<AcquisitionSpace, double>& direction) const;

  // One ray through the middle of each pixel; all kinds of lenses.
  struct Picture {
    image::Image color;    // RGBA, premultiplied; alpha is 1 on the object, 0 elsewhere
    image::Image observed; // one channel, as Frame::observed
  };
  // Throws Error where texels cannot be read, and Cancelled.
  Picture render(const capture::Camera<AcquisitionSpace>& camera, const Progress& progress = {}) const;

private:
  struct Place {
    uint32_t region = 0, triangle = 0; // of its chart
  };

  const Field* field_;
  const Textures* textures_;
  RayCaster<AcquisitionSpace> rays_;
  std::vector<Place> places_; // by triangle of the mesh
};

} // namespace surflect::slf
