// Observations of texels: the photographs that see a point of the surface, with the radiance they show.
#pragma once

#include "render/lightfield/common/sight.h"
#include "render/lightfield/slf/texel_points.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/smooth_normals.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::slf {

using lightfield::Observation;

// Observations of all texels of a chart, in the order of photographs.
class Observations {
public:
  Observations(std::span<const TexelPoint> points, const TriangleMesh& mesh, const SmoothNormals& normals,
               const lightfield::Sight& sight);

  size_t texels() const { return first_.size() - 1; }
  std::span<const Observation> of(size_t texel) const {
    return std::span(all_).subspan(first_[texel], first_[texel + 1] - first_[texel]);
  }

private:
  std::vector<size_t> first_; // #texels + 1
  std::vector<Observation> all_;
};

} // namespace surflect::slf
