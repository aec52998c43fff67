// Slab: the lines that cross two parallel planes, by where they cross them.
//
// [Gortler 1996] Gortler, Grzeszczuk, Szeliski, Cohen: The Lumigraph.   [Azuma 1999, §4]
// Symbols: (s, t) place on the plane towards the viewer, (u, v) place on the plane at the object; P a point
// of the object; M the steepest slope of a slab's lines against its normal.
//
// Six slabs stand around an object, one for each side of its box. The side that a line faces most, seen from
// the viewer, tells its slab.
//
// The uv plane passes through the middle of the box: on the planes through its sides, lines of slope 1 spread
// the object half as wide again, and texels would be spent on what is outside it. The st plane stands several
// radii away. The nearer it is, the smaller is the part of its grid that any one point of the object uses.
//
// Lines have no ends: radiance is that at the point where the line, coming from the st side, first meets the
// object. A camera may stand before or beyond the st plane. Inside the convex hull of the object, a camera
// may see through a hollow points that are not first on their line. Its picture then shows the radiance of
// the points that are first. [Azuma 1999, §4.2.2]
#pragma once

#include "render/lightfield/lumigraph/depth_geometry.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lumigraph {

using Point = Point3<AcquisitionSpace, double>;
using Direction = Direction3<AcquisitionSpace, double>;

inline constexpr size_t kSlabs = 6;
inline constexpr size_t kMostTexels = size_t{1} << 33; // of a lumigraph
inline constexpr int kMostNodes = 45;                  // along each side of an st grid

// Coordinates of a line in a slab. Node (i, j) of the st grid is at s = i, t = j. Texel (k, l) of a node's
// picture is centred at u = k + 1/2, v = l + 1/2.
struct LineCoordinates {
  double s = 0, t = 0, u = 0, v = 0;
};

struct Line {
  Point origin;        // on the st plane
  Direction direction; // unit, towards the uv plane
};

struct Slab {
  int axis = 0;                               // of the planes' normal: 0 x, 1 y, 2 z
  double sign = 1;                            // the viewer's side: +1 or -1 along the axis
  double stPlane = 0, uvPlane = 0;            // coordinates along the axis
  std::array<double, 2> stLow{}, stSpacing{}; // place of node (0, 0), and distances between nodes
  std::array<double, 2> uvLow{};              // corner of texel (0, 0)
  double uvSpacing = 0;                       // side of a texel
  int nodes = 0;                              // along each side of the st grid, 2 at least
  int width = 0, height = 0;                  // of a node's picture, texels

  // Axes of (s, u) and (t, v). With the normal they are right-handed.
  int uAxis() const { return (axis + (sign > 0 ? 1 : 2)) % 3; }
  int vAxis() const { return (axis + (sign > 0 ? 2 : 1)) % 3; }

  size_t nodeTexels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  size_t texels() const { return static_cast<size_t>(nodes) * static_cast<size_t>(nodes) * nodeTexels(); }

  Point stPoint(double s, double t) const;
  Point uvPoint(double u, double v) const;

  // Coordinates of the line through two points whose coordinates along the axis differ.
  LineCoordinates coordinatesOf(const Point& a, const Point& b) const;
  Line lineOf(const LineCoordinates& coordinates) const;

  friend bool operator==(const Slab&, const Slab&) = default;
};

using Slabs = std::array<Slab, kSlabs>;

struct SlabOptions {
  int nodes = 7;            // along each side of an st grid, 2..45
  size_t texels = 16617744; // of all slabs together, at most
  double distance =
      20; // of the st planes from the middle of the box, in halves of its diagonal; 1.25 at least
  double overlap = 0.02; // see slabWeights()
};

// Slabs around a mesh, in the order +x, -x, +y, -y, +z, -z. All have texels of one size, as small as the
// quota allows; so a narrow side has fewer. Throws Error for options out of range, a mesh without extent, and
// if the quota leaves a picture fewer than 2 x 2 texels over the object.
Slabs slabsAround(const TriangleMesh& mesh, const SlabOptions& options);

// Weights of the slabs for lines of a direction towards the viewer, which need not be unit but not 0 either.
// The slab of the largest component counts most. The weight of another slab falls by weightSlope() times
// (largest - component) / largest; it is 0 where the component is at most largest / (1 + overlap). Weights
// are continuous, not negative, and sum to 1. With an overlap of 0, the slab of the largest component has
// weight 1, the first of equal ones.
std::array<double, kSlabs> slabWeights(const Direction& towardsViewer, double overlap);
// (1 + overlap) / overlap, at most 1e30: finite in single precision, too. The overlap is not 0.
double weightSlope(double overlap);

// Lumigraph in memory: the pictures of all nodes of six slabs, and the geometry that corrects depth.
// [Gortler 1996] Gortler, Grzeszczuk, Szeliski, Cohen: The Lumigraph.

// Half floats r, g, b of linear radiance, and 1 where the texel's line meets the object, else 0. Colours
// beside the object are smooth continuations of those on it. All are finite.
using Texel = std::array<uint16_t, 4>;

struct Lumigraph {
  Slabs slabs;
  double overlap = 0; // see slabWeights()
  // Pictures of each slab: node (i, j) is picture i + j * nodes; row 0 has v = 1/2.
  std::array<std::vector<Texel>, kSlabs> texels;
  DepthGeometry geometry;

  std::span<const Texel> picture(size_t slab, int i, int j) const {
    const Slab& shape = slabs[slab];
    const auto node = static_cast<size_t>(i + j * shape.nodes);
    return std::span(texels[slab]).subspan(node * shape.nodeTexels(), shape.nodeTexels());
  }
};

} // namespace surflect::lumigraph
