// Textures of a region for its sample directions, from the photographs that see its texels.
//
// A texel that no photograph sees is filled from the others of its region by pull-push, direction by
// direction; unseen_texels.h fills it across the region's border. A texel counts as observed in a direction
// if a photograph sees it from within the spacing of the direction mesh there; otherwise its value is
// extrapolated from other directions or filled in.
#pragma once

#include "render/lightfield/common/sight.h"
#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/direction_mesh.h"
#include "render/lightfield/slf/field.h"
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

// Choice of a region's sample directions: more where radiance changes faster with direction. A direction of a
// fine mesh is left out if the hat functions of the kept directions reproduce its texture. Error of a
// direction: root mean square, over texels observed in that direction and over channels, of the difference in
// radiance. Directions are added to the octahedron's six, always the one with the largest error, until no
// error exceeds the tolerance.

// Radiance of up to kJudgedTexels seen texels of a region, spread evenly, in each fine direction.
struct DirectionalRadiance {
  std::vector<std::vector<Vec3<float>>> radiance; // by direction, of each texel
  std::vector<std::vector<uint8_t>> isObserved;   // likewise: 1 if a photograph is near the direction
};
inline constexpr size_t kJudgedTexels = 256;

DirectionalRadiance directionalRadiance(const Observations& observations, const DirectionMesh& fine,
                                        Blend blend);

// Error of each fine direction if only `kept` (indices of fine directions) is stored; 0 for directions that
// are kept or not observed. `mesh` triangulates the kept directions, in their order.
std::vector<double> reproductionErrors(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                       const std::vector<size_t>& kept, const DirectionMesh& mesh);

// Indices of the fine directions to keep, in rising order. The first six of `fine` surround the sphere, as in
// octahedronDirections(). Tolerance in units of radiance.
std::vector<size_t> adaptedDirections(const DirectionalRadiance& radiance, const DirectionMesh& fine,
                                      double tolerance);

} // namespace surflect::slf
