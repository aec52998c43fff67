// Environment maps: pictures of the light from all directions, and the directional lights that approximate
// them.
#pragma once

#include "srf/image/image.h"
#include "surfel/base/progress.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace surflect::ulr {

enum class EnvironmentMapping {
  latLong, // columns are longitudes, rows latitudes: the whole sphere, twice as wide as high
  angular, // a light probe: the distance from the middle is the angle from -z; the sphere fills a disk
};

// The direction of a place in the picture; u from its left edge (0) to its right (1), v from top to bottom.
// Latitude pi (1/2 - v), longitude 2 pi (u - 1/2) from -z towards x.
Direction3<EnvironmentSpace, double> latLongDirection(double u, double v);

// The angle from -z is pi r, r the distance from the middle of the picture in halves of its side; nothing
// beyond the disk, r > 1.  [Debevec 1998, Rendering Synthetic Objects into Real Scenes, light probe images]
std::optional<Direction3<EnvironmentSpace, double>> angularDirection(double u, double v);

// One texel, or many gathered into one: a light so far away that its rays are parallel.
struct EnvironmentLight {
  Direction3<EnvironmentSpace> towards; // unit
  Rgb irradiance;                       // of a surface facing it: the integral of radiance over solid angle

  friend bool operator==(const EnvironmentLight&, const EnvironmentLight&) = default;
};

struct EnvironmentMap {
  std::vector<EnvironmentLight> texels; // those that shine; solid angles of a picture sum to 4 pi
  size_t replaced = 0;                  // texels with samples below 0 or no numbers, which are taken for 0
  size_t clamped = 0;                   // texels with infinite samples, which are taken for kLargestHalf
};

// An infinite sample is a sun beyond the range of a half float.  [IEEE 754-2008, 3.6, binary16]
inline constexpr float kLargestHalf = 65504;

// Gray or RGB radiance; alpha is ignored.
EnvironmentMap environmentOf(const image::Image& radiance, EnvironmentMapping mapping,
                             const Progress& progress = {});

// Without a mapping the picture's shape tells: 2:1 is a lat-long, 1:1 an angular map. Throws Error, also
// where samples are not floating point, and beyond 2^25 pixels; and Cancelled, as all three here.
EnvironmentMap readEnvironment(const std::filesystem::path& path,
                               std::optional<EnvironmentMapping> mapping = std::nullopt,
                               const Progress& progress = {});

// Few lights of the same total irradiance, each at the mean direction of what it stands for. The directions
// are cut where they spread most, weighted by energy, so that small bright sources become lights of their
// own, until the mean spread is at most `spread` > 0: the energy-weighted mean square distance of directions
// from their light (unit sphere). A constant map becomes about 2 pi / (3 spread) lights. The integral of a
// smooth function f errs by about half of the spread times f''. Never more than kMostGathered lights.
//   [after Debevec 2005, A Median Cut Algorithm for Light Probe Sampling]
inline constexpr size_t kMostGathered = 4096;
std::vector<EnvironmentLight> gathered(std::vector<EnvironmentLight> lights, double spread,
                                       const Progress& progress = {});

// The sum of irradiances: of a constant map 4 pi times its radiance.
Rgb totalIrradiance(std::span<const EnvironmentLight> lights);

} // namespace surflect::ulr
