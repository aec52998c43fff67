// Radiance of one texel in sample directions, from the photographs that see it.
//
// [Azuma 1999] Azuma: Interactive Rendering of Surface Light Fields.
// [Buehler 2001] Buehler et al.: Unstructured Lumigraph Rendering, SIGGRAPH.
// Symbols: r_i sample directions; B_i their hat functions; F_i radiance in r_i; d_v, L_v, f_v direction,
// radiance and fade of observation v.
#pragma once

#include "render/lightfield/common/sight.h"
#include "render/lightfield/slf/chart.h"
#include "render/lightfield/slf/direction_mesh.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::slf {

// Surface points of the texels of a chart.
struct TexelPoint {
  static constexpr uint32_t kNone = UINT32_MAX;

  uint32_t meshTriangle = kNone; // kNone if the chart has no triangle with an area, on texture and surface
  Point3<AcquisitionSpace, double> position;
  bool isInside = false; // the texel's centre lies in the chart; otherwise the point is the chart's nearest
};

// One for each texel, rows of the chart's width, row 0 first. Where triangles overlap, the first one counts.
std::vector<TexelPoint> texelPoints(const TriangleMesh& mesh, const Chart& chart);

using lightfield::Observation;

enum class Blend {
  nearest, // the photograph from nearest to the direction  [Azuma 1999, §5.1]
  ulr,     // blend of the kBlended nearest ones, weighted as in srf/weights/ulr.h  [Buehler 2001]
  fitted   // least squares: what is drawn agrees best with all photographs that see the texel
};

inline constexpr size_t kBlended = 4;

// Each returns F_i for the sample directions whose `isUsed` is not 0, and 0 for the others. There is at least
// one observation. Equally near photographs are asked in their order.
std::vector<Vec3<float>> nearestRadiance(std::span<const Observation> observations,
                                         const DirectionMesh& directions, std::span<const uint8_t> isUsed);
std::vector<Vec3<float>> blendedRadiance(std::span<const Observation> observations,
                                         const DirectionMesh& directions, std::span<const uint8_t> isUsed);
// Minimises  sum_v f_v |sum_i B_i(d_v) F_i - L_v|^2 + kPrior sum_i |F_i - U_i|^2  where U_i is the blended
// radiance; values below 0 are then set to 0.
std::vector<Vec3<float>> fittedRadiance(std::span<const Observation> observations,
                                        const DirectionMesh& directions, std::span<const uint8_t> isUsed);
inline constexpr double kPrior = 0.5;

std::vector<Vec3<float>> texelRadiance(Blend blend, std::span<const Observation> observations,
                                       const DirectionMesh& directions, std::span<const uint8_t> isUsed);

} // namespace surflect::slf
