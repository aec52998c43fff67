// A warp at one instant: a map of space to itself, with its Jacobian or central differences
// [Weyrich 2005, Eq. 6].
//
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
// Symbols: Psi the warp; x a point before it; J = dPsi/dx its Jacobian, columns dPsi/dx, dPsi/dy, dPsi/dz.
//
// A whole warp maps acquisition space to object space; deform.h has the types. Links of a chain meet in
// intermediate spaces, so warps themselves use bare vectors, in scene units.
//
// A new warp also gets a struct of tracks in motion.h and an entry in render/scene/script.cpp
// (docs/adding.md).
#pragma once

#include "surfel/math/space.h"
#include "warp/expression.h"
#include "warp/track.h"

#include <array>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace surflect::warp {

// Batch of points that pass through a warp.

// Positions, tangents u and v, and the determinant of the Jacobian so far; structure of arrays. The first
// `count` entries are valid; entries beyond may be computed but are undefined.
struct WarpBatch {
  static constexpr int capacity = 128; // fits the first cache; a multiple of all lanes
  int count = 0;
  alignas(64) double x[capacity], y[capacity], z[capacity];
  alignas(64) double ux[capacity], uy[capacity], uz[capacity];
  alignas(64) double vx[capacity], vy[capacity], vz[capacity];
  alignas(64) double determinant[capacity];
};

// All functions are thread-safe and never throw. Where the warp has no value the result is not finite.
class Warp {
public:
  virtual ~Warp() = default;
  virtual Vec3<double> position(const Vec3<double>& x) const = 0;
  // Exact Jacobian. A warp without a closed form returns an empty value for every x; use centralDifferences
  // then.
  virtual std::optional<Mat3<double>> jacobian(const Vec3<double>& x) const = 0;
  // Warps many points at once: x becomes Psi(x), u and v become J u and J v, and the determinant is
  // multiplied by det J. Each point's result depends on its own numbers only. Asserts that the warp has an
  // exact Jacobian. This default calls the two functions above, point by point; warps with vector kernels
  // (deform_kernels.h) override it.
  virtual void carry(WarpBatch& batch) const;
};

using WarpPointer = std::unique_ptr<const Warp>;

// Derivatives of the warp along the columns of `directions`, as columns:
//   (Psi(x + epsilon d) - Psi(x - epsilon d)) / (2 epsilon)   [Weyrich 2005, Eq. 6]
// Error: epsilon^2/6 of the third derivative along d, and rounding of about 2^-53 |Psi| / epsilon.
Mat3<double> centralDifferences(const Warp& warp, const Vec3<double>& x, const Mat3<double>& directions,
                                double epsilon);

// All axes and directions below are unit vectors and all parameters finite: asserted.

// Rotates about the axis through the centre, right-handed, then translates.
WarpPointer rigidWarp(const Vec3<double>& axis, Angle angle, const Vec3<double>& center,
                      const Vec3<double>& translation);

// Stretches along x, y, z about the centre; a negative factor mirrors.
WarpPointer scaleWarp(const Vec3<double>& factors, const Vec3<double>& center);

// Rotates each plane perpendicular to the axis by anglePerUnit times the plane's signed distance from the
// centre.
WarpPointer twistWarp(const Vec3<double>& axis, Angle anglePerUnit, const Vec3<double>& center);

// Bends the axis into a circle that leaves the centre along the axis and curves towards `direction` (at right
// angles to it) by anglePerUnit per unit of arc length; planes perpendicular to the axis become planes
// perpendicular to the circle. There are no ends: the circle closes after 2 pi / anglePerUnit. Points further
// along `direction` than the circle's radius 1 / anglePerUnit turn inside out.
WarpPointer bendWarp(const Vec3<double>& axis, const Vec3<double>& direction, Angle anglePerUnit,
                     const Vec3<double>& center);

// Scales perpendicular to the axis by exp(growthPerUnit h), which is never 0, where h is the signed distance
// from the centre along the axis.
WarpPointer taperWarp(const Vec3<double>& axis, double growthPerUnit, const Vec3<double>& center);

// Displaces along `direction` by amplitude sin(2 pi axis . (x - center) / wavelength + phase); wavelength is
// not 0.
struct SineWave {
  Vec3<double> axis, direction, center;
  double amplitude = 0, wavelength = 1; // scene units
  Angle phase = Angle();
};
WarpPointer sineWarp(const SineWave& wave);

// New coordinates by three formulas in the variables x, y, z, t, frame, s in this order. Has no exact
// Jacobian. Formulas see x + origin; `origin` is subtracted from their result.
inline constexpr std::array<std::string_view, 6> warpVariables = {"x", "y", "z", "t", "frame", "s"};
WarpPointer expressionWarp(Expression x, Expression y, Expression z, const ShotTime& time,
                           const Vec3<double>& origin = Vec3<double>::Zero());

// Composition of warps; the first link acts first, and an empty chain is the identity. Has an exact Jacobian,
// by the chain rule, if all links do.
WarpPointer chainWarp(std::vector<WarpPointer> links);

} // namespace surflect::warp
