// Clusters of surfels whose reflectance one table describes: kinds of surface, found from the photographs
// alone.
//
//   1. k-means over ring profiles of the surfels: mean tabulated value by distance of the half vector from
//      the normal, up to a gain [Lloyd 1982; seeds: Arthur 2007].
//   2. Reassignment of each surfel to the table that predicts its photographs best, each photograph with the
//      gain of the others; then the tables anew. These tables know |p| and |e| alone (withoutAngles): the
//      frames do not follow the fibres yet.
//   3. Merging: the two clusters whose union costs least become one, while photographs that were left out
//      are predicted nearly as well. Every other photograph of each surfel is left out of steps 1 and 2; a
//      table that is fitted to those of half of a cluster's surfels predicts those of the other half.
//
// Memberships are soft: m_k is proportional to E_k^-8 - E_(4)^-8, with E_k the error of table k at the surfel
// and E_(4) the fourth smallest error, so that a table enters and leaves a mixture at weight 0.
//
// [Lloyd 1982] Lloyd: Least squares quantization in PCM, IEEE Trans. Inf. Theory 28(2).
// [Arthur 2007] Arthur, Vassilvitskii: k-means++: The Advantages of Careful Seeding, SODA.
#pragma once

#include "srf/reflectance/photographs.h"
#include "srf/reflectance/reflectance_table.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::reflectance {

// Rings of the half vector, by |p|. A profile holds the logarithm of a surfel's mean tabulated value in each
// ring and channel, less the mean of all surfels there, and less the mean of these differences over the
// rings: gains leave profiles nearly as they are.
inline constexpr std::array<float, 4> kRingEdges{0.06f, 0.13f, 0.25f, 0.45f};
using RingProfile = std::array<float, 3 * (kRingEdges.size() + 1)>; // ring by ring

// Profiles of all surfels; 0 in rings without a photograph.
std::vector<RingProfile> ringProfiles(const Photographs& photographs, float white);

// Membership of each surfel in one cluster: 1 for its members, 0 for others.
std::vector<float> membershipIn(std::span<const uint32_t> cluster, uint32_t which);

// Cluster of each profile, 0..k-1, by k-means; the same for the same profiles.
std::vector<uint32_t> kMeans(std::span<const RingProfile> profiles, size_t k);

struct ClusterOptions {
  float white = 1;              // reflectance of a white pixel, > 0
  size_t mostClusters = 8;      // before merging
  double mergeTolerance = 0.1;  // error that a union may add, as a part of its parts' error: 0.4 dB
  size_t photographs = 100'000; // about as many are looked at; surfels are left out evenly
};

struct Clusters {
  size_t count = 0;
  std::vector<uint32_t> of;  // cluster of each surfel
  std::vector<float> errors; // leftOutErrors of each surfel by each cluster's table: `count` a surfel
};

// Finds the clusters of surfels; one if nothing tells them apart. Throws Cancelled.
Clusters findClusters(const Photographs& photographs, const ClusterOptions& options,
                      const Progress& progress = {});

// Errors averaged over the nearest surfels, weighted by a nearness that is 1 at the surfel itself and 0 at
// the neighbour after the last: mixtures then change smoothly over the surface. errors: those of all tables,
// a surfel after another (a multiple of #places). `neighbors` > 0 includes the surfel itself.
std::vector<float> smoothedErrors(std::span<const Point3<AcquisitionSpace>> places,
                                  std::span<const float> errors, size_t neighbors = 8);

// Mixture of tables at a surfel, from the error of each (at least one).
TableMixture mixtureOf(std::span<const float> errors);

// Share of the table in an answer, 0..1, from its error at a surfel and the error of predictions by the
// surfel's other photographs: 1 where the table is clearly better, 0 where it is not better. Both are errors
// of two photographs or more; where photographs predict one another exactly, the share is 0.
float tableShare(float tableError, float photographsError);

} // namespace surflect::reflectance
