// Tilts: corrections of surfels' normals for the tables, found from their photographs. Normals of scans and
// hulls that are a few degrees off move highlights by twice as much.
//
//   n' = (t_u u + t_v v + n) / |t_u u + t_v v + n|
//   E(t) = mean over the photographs of a patch of logError(g T(t), y)  +  0.02 |t|^2
//
// Symbols: n, u, v frame of a surfel, n' its normal under the tilt t; y reflectance, T(t) its prediction by
// the surfel's mixture of tables in the tilted frame, g the surfel's gain. Patches seek the least E by
// compass search [Kolda 2003] from t = 0 on. Tilts of surfels are means over near patches, each carried along
// the shortest arc.
//
// [Kolda 2003] Kolda, Lewis, Torczon: Optimization by Direct Search, SIAM Review 45(3).
#pragma once

#include "srf/reflectance/fibres.h"
#include "srf/reflectance/photographs.h"
#include "srf/reflectance/reflectance_table.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <span>
#include <vector>

namespace surflect::reflectance {

struct Tilt {
  float u = 0, v = 0; // t

  friend bool operator==(const Tilt&, const Tilt&) = default;
};
inline constexpr float kMostTilt = 0.25f; // of |t|: 14 degrees

// Rotation by the shortest arc from n to n', in the frame (u, v, n).
Mat3<float> tiltRotation(Tilt tilt);

inline Direction3<SurfelSpace> rotated(const Mat3<float>& rotation,
                                       const Direction3<SurfelSpace>& direction) {
  return assume<Direction3<SurfelSpace>>(Vec3<float>(rotation * direction.raw()));
}

// The frame, rotated by a tilt.
SurfelFrame tiltedFrame(const SurfelFrame& frame, Tilt tilt);

// Surfels' tables and frames, as they are while tilts are sought: one entry each a surfel.
struct TiltedTables {
  const ReflectanceTables& tables;
  std::span<const TableMixture> mixtures;
  std::span<const Rgb> gains;
  std::span<const Angle> fibres; // in the tilted frame
  float white;                   // reflectance of a white pixel
};

// A tilt of each patch, in the frame of its centre. Costs 25 predictions a photograph. Throws Cancelled.
std::vector<Tilt> seekTilts(const TiltedTables& tables, const Photographs& photographs,
                            std::span<const SurfelFrame> frames, const Patches& patches,
                            const Progress& progress = {});

// Share of the error that tilts save: every `step`-th patch seeks its tilt by every other photograph, and the
// errors are those of the rest.
double savedByTilts(const TiltedTables& tables, const Photographs& photographs,
                    std::span<const SurfelFrame> frames, const Patches& patches, size_t step,
                    const Progress& progress = {});

// A tilt of each frame: the mean of those of the nearest places, weighted by a nearness that falls to 0 where
// another place becomes nearer.
std::vector<Tilt> tiltsNear(std::span<const Point3<AcquisitionSpace>> places,
                            std::span<const SurfelFrame> frames, std::span<const Tilt> tilts,
                            std::span<const Point3<AcquisitionSpace>> at,
                            std::span<const SurfelFrame> framesAt);

} // namespace surflect::reflectance
