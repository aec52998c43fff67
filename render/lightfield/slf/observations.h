// Observations of texels: the photographs that see a point of the surface, with the radiance they show.
//
// A photograph sees a point if the point faces it by more than kGrazing, projects into the picture, and
// nothing is in the way; and if the pixels around it show this part of the surface, since those at its edge
// mix it with what is in front or behind. Observations fade within a few pixels of hidden texels.
#pragma once

#include "render/lightfield/slf/direction_mesh.h"
#include "render/lightfield/slf/photographs.h"
#include "render/lightfield/slf/texel_points.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

// Least cosine between the triangle's normal and the direction to the viewer: that of 85 degrees.
inline constexpr double kGrazing = 0.087;

struct Observation {
  uint32_t photograph = 0;
  Direction3<AcquisitionSpace> towards; // from the surface towards the viewer; unit
  Vec3<float> radiance = Vec3<float>::Zero();
  float fade = 1; // 0..1, above 0; falls at grazing angles, near the picture's border and near hidden texels
};

// Observations of all texels of a chart, in the order of photographs.
class Observations {
public:
  // Points are those of a texture with rows of `width` texels.
  Observations(std::span<const TexelPoint> points, int width, const TriangleMesh& mesh,
               const SmoothNormals& normals, const Photographs& photographs,
               const RayCaster<AcquisitionSpace>& rays);

  size_t texels() const { return first_.size() - 1; }
  std::span<const Observation> of(size_t texel) const {
    return std::span(all_).subspan(first_[texel], first_[texel + 1] - first_[texel]);
  }

private:
  std::vector<size_t> first_; // #texels + 1
  std::vector<Observation> all_;
};

} // namespace surflect::slf
