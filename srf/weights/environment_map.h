// Environment maps: images of the light from all directions, and their approximation by directional lights.
#pragma once

#include "srf/image/image.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace surflect::weights {

enum class EnvironmentMapping {
  latLong, // columns are longitudes, rows are latitudes; the whole sphere, twice as wide as high
  angular, // light probe: the distance from the centre is proportional to the angle from -z; the sphere fills
           // a disk
  mirrorBall, // photograph of a mirror ball that fills the square, by a distant camera on +z
};

// Words for the mappings, in scripts and options.
inline constexpr std::array<std::pair<std::string_view, EnvironmentMapping>, 3> kMappings = {
    {{"latlong", EnvironmentMapping::latLong},
     {"angular", EnvironmentMapping::angular},
     {"mirror_ball", EnvironmentMapping::mirrorBall}}};

// Direction of a point of a lat-long map; u runs from the left edge (0) to the right (1), v from top to
// bottom. Latitude pi (1/2 - v); longitude 2 pi (u - 1/2), from -z towards x.
Direction3<EnvironmentSpace, double> latLongDirection(double u, double v);

// Direction of a point of an angular map: its angle from -z is pi r, where r is the distance from the centre
// in half sides. Empty outside the disk, r > 1.  [Debevec 1998, Rendering Synthetic Objects into Real Scenes,
// light probe images]
std::optional<Direction3<EnvironmentSpace, double>> angularDirection(double u, double v);

// Direction that a point of a mirror ball shows: the ray from the camera on +z is reflected by the normal
// there, so that the middle shows z. Empty outside the ball. Equal areas show equal solid angles.
std::optional<Direction3<EnvironmentSpace, double>> mirrorBallDirection(double u, double v);

// Directional light of a texel or a part of it, or of several merged ones.
struct EnvironmentLight {
  Direction3<EnvironmentSpace> towards; // unit
  Rgb irradiance;   // irradiance of a surface facing the light: the integral of radiance over solid angle
  float spread = 0; // mean square distance of the merged directions from their mean, on the unit sphere

  friend bool operator==(const EnvironmentLight&, const EnvironmentLight&) = default;
};

inline constexpr size_t kLeastParts = 128 * 64;
struct EnvironmentMap {
  std::vector<EnvironmentLight> lights; // of nonzero texels or their parts; solid angles sum to 4 pi
  size_t replaced = 0;                  // texels with negative or NaN samples, which count as 0
  size_t clamped = 0;                   // texels with infinite samples, which count as kLargestHalf
};

// Radiance of an infinite sample, such as a sun beyond the range of half floats.  [IEEE 754-2008, 3.6,
// binary16]
inline constexpr float kLargestHalf = 65504;

// Lights of a map of grey or RGB radiance; alpha is ignored. The texels of a small map are divided into
// parts of the same radiance, so that the image, which is not empty, has kLeastParts: a few texels are no
// lamps. Throws Cancelled.
EnvironmentMap environmentOf(const image::Image& radiance, EnvironmentMapping mapping,
                             const Progress& progress = {});

// Reads a map from a file. Without a mapping, a 2:1 picture is lat-long. Throws Error for other shapes,
// unreadable files, samples that are not floating point and more than 2^25 pixels; and Cancelled.
EnvironmentMap readEnvironment(const std::filesystem::path& path,
                               std::optional<EnvironmentMapping> mapping = std::nullopt,
                               const Progress& progress = {});

// Merges lights into a few with the same total irradiance, each at the mean direction of its cluster. Spread
// is the energy-weighted mean square distance of directions from their light, on the unit sphere. The cluster
// of greatest spread is cut until the spread of all directions is at most `spread` > 0; small bright sources
// thus become lights of their own. A constant map becomes about 2 pi / (3 spread) lights, at most
// kMaxClusteredLights. The integral of a smooth function f errs by about f'' spread / 2. Throws Cancelled.
//   [after Debevec 2005, A Median Cut Algorithm for Light Probe Sampling]
inline constexpr size_t kMaxClusteredLights = 4096;
std::vector<EnvironmentLight> clusteredLights(std::vector<EnvironmentLight> lights, double spread,
                                              const Progress& progress = {});

// Moves key lights to the front and returns their number; both parts keep their order. A key light is small,
// with a spread of at most kKeySpread, and strong: it has twice the mean strength or more, or a sixteenth of
// the total. Strength is the sum of the channels of irradiance. Only the kMostKeyLights strongest are key
// lights.
inline constexpr float kKeySpread = 0.04f; // a disk of 16 degrees around its middle
inline constexpr size_t kMostKeyLights = 32;
size_t moveKeyLightsFirst(std::span<EnvironmentLight> lights);

// Sum of irradiances; 4 pi times the radiance of a constant map.
Rgb totalIrradiance(std::span<const EnvironmentLight> lights);

} // namespace surflect::weights
