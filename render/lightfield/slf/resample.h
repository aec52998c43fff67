// Textures of a region for its sample directions, from the photographs that see its texels.
//
// A texel that no photograph sees is filled from the others of its region by pull-push, direction by
// direction. A texel counts as observed in a direction if a photograph sees it from within the spacing of the
// direction mesh there; otherwise its value is extrapolated from other directions or filled in.
#pragma once

#include "render/lightfield/common/sight.h"
#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/direction_mesh.h"
#include "render/lightfield/slf/field.h"
#include "render/lightfield/slf/texel_points.h"
#include "render/lightfield/slf/texel_radiance.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/smooth_normals.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

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

// Marks the directions whose textures a picture of a region can need; #directions. 1 if the direction is a
// corner of a triangle of the direction mesh in which some direction is in front of some triangle of the
// region. The region shows only its back in the other directions, and is not drawn there.
std::vector<uint8_t> usedDirections(const TriangleMesh& mesh, const Chart& chart,
                                    const DirectionMesh& directions);

struct RegionTextures {
  std::vector<std::vector<Texel>> textures; // one per direction; empty for directions that are not used
  size_t unseenTexels = 0;                  // that no photograph sees
  size_t texels = 0;                        // of each texture

  bool isUnseen() const { return unseenTexels == texels; }
};

// Largest angle between each direction and its neighbours in the mesh, as 1 - cos(angle).
std::vector<float> spacingPenalties(const DirectionMesh& directions);

// Textures with rows of `width` texels. isUsed: #directions, see usedDirections(). A region that no
// photograph sees is black, and nowhere observed.
RegionTextures resample(const Observations& observations, int width, const DirectionMesh& directions,
                        std::span<const uint8_t> isUsed, Blend blend);

// Texel of a radiance, which is clamped to the range of half floats.
Texel texelOf(const Vec3<float>& radiance, bool isObserved);

} // namespace surflect::slf
