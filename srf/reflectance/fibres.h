// Fibre directions: the u of surfels' frames, found from their photographs.
//
// A brushed or woven surface scatters light across its fibres more than along them: in p, its highlight is
// long across the fibres. The first guess for a patch of surfels is the minor axis of the highlight's second
// moments,
//
//   q = <p_u^2 - p_v^2, 2 p_u p_v>_(w z) - <p_u^2 - p_v^2, 2 p_u p_v>_w,   w = exp(-|p|^2 / 0.08)
//   angle of the fibre = atan2(q_2, q_1) / 2 + pi / 2
//
// then a table is fitted to the photographs of all patches, and each patch takes the angle at which the table
// predicts its photographs best; these two steps are repeated. Directions of surfels are the average of those
// of near patches as lines: of their doubled angles [Mardia 1972, §1.5], each carried along the shortest arc.
//
// Symbols: z tabulated value that a photograph shows, in units of a white pixel and at most 2; <.>_w mean
// with weights w over the photographs of a patch. The second mean removes the anisotropy of the photographed
// directions themselves.
//
// [Mardia 1972] Mardia: Statistics of Directional Data.
#pragma once

#include "srf/reflectance/photographs.h"
#include "srf/reflectance/table_fit.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::reflectance {

using SurfelFrame = Rotation<AcquisitionSpace, SurfelSpace, float>; // columns u, v, n

// Angle of the u of `from`, carried by the rotation that takes one normal to the other by the shortest arc,
// in the frame `to`: from its u towards its v. Opposite normals have no shortest arc; any angle is returned.
Angle carriedAngle(const SurfelFrame& from, const SurfelFrame& to);

// A frame turned about its normal, from u towards v.
SurfelFrame turnedFrame(const SurfelFrame& frame, Angle angle);

// A division of surfels into patches of neighbours.
struct Patches {
  std::vector<uint32_t> of;      // patch of each surfel
  std::vector<uint32_t> centres; // of each patch: the surfel whose frame is the patch's
};

// At most `count` > 0 patches about centres as far from one another as possible, each surfel with the nearest
// [Gonzalez 1985]. Places in scene units. Costs count #surfels.
// [Gonzalez 1985] Gonzalez: Clustering to Minimize the Maximum Intercluster Distance, Theor. Comput. Sci. 38.
Patches patchesOf(std::span<const Point3<AcquisitionSpace>> places, size_t count);

struct Fibre {
  Angle angle;        // in the frame of the patch
  float strength = 0; // 0: errors do not depend on the angle; 1: other angles predict nothing
};

// Fibres of patches by second moments; their strength is |q| over the mean of |p|^2.
std::vector<Fibre> highlightFibres(const Photographs& photographs, std::span<const SurfelFrame> frames,
                                   const Patches& patches, float white);

// Fibres refined in turn with one table that is fitted to all patches. Strength: 1 - least error / mean error
// over all angles. `options` are those of the table. Throws Cancelled.
std::vector<Fibre> refinedFibres(const TableGrid& grid, const Photographs& photographs,
                                 std::span<const SurfelFrame> frames, const Patches& patches,
                                 std::vector<Fibre> fibres, const FitOptions& options, size_t rounds = 3,
                                 const Progress& progress = {});

// Mean of lines at the given angles; 0 if they cancel. Continuous in angles and weights otherwise.
Angle meanLine(std::span<const Angle> angles, std::span<const float> weights);

// Angle of the fibre in each surfel's frame: the mean line of the nearest patches, weighted by strength, and
// by nearness that falls to 0 where another patch becomes nearer.
std::vector<Angle> fibreAngles(std::span<const Point3<AcquisitionSpace>> places,
                               std::span<const SurfelFrame> frames, const Patches& patches,
                               std::span<const Fibre> fibres);

} // namespace surflect::reflectance
