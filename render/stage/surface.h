// Surfaces of the light stage: meshes with a shading frame per vertex, and operations on them.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"
#include "warp/expression.h"
#include "warp/warp.h"

#include <vector>

namespace surflect::stage {

// Maximum number of triangles of a stage.
constexpr size_t kMostTriangles = size_t{1} << 25;
// Throws Error for more than kMostTriangles.
void requireFewTriangles(size_t count);

// Limit of each coordinate, as in a stage file.
constexpr float kFarthest = 1e9f;

struct Surface {
  TriangleMesh mesh; // counter-clockwise seen from outside
  // One per vertex, of any length; 0 if undefined. Tangents run along the fibre of brushed or fibrous
  // materials.
  std::vector<Direction3<AcquisitionSpace, double>> normals, tangents;
  // Texture coordinates of each vertex, (0, 0) to (1, 1); empty if undefined.
  std::vector<Vec2<double>> textureCoordinates;
};

// Throws Error if rounding to single precision has flattened every triangle, or made a vertex infinite.
void requireVisible(const Surface& surface);

// Appends the triangles of `other`. Either both have texture coordinates, or neither, or `surface` is empty.
void append(Surface& surface, const Surface& other);

// Surface mapped by x -> linear x + offset; orientation is restored if the map mirrors.
Surface transformed(const Surface& surface, const Mat3<double>& linear, const Vec3<double>& offset);

// Surface with tangents rotated about the normals, counter-clockwise seen from outside.
Surface withTangentsTurned(const Surface& surface, Angle angle);

// Surface with texture coordinates by projection along z, from a square around it; (1, 1) is at the largest x
// and y.
Surface withPlanarTexture(const Surface& surface);

// Variables of a displacement: position and texture coordinates.
constexpr std::string_view kHeightVariables[] = {"x", "y", "z", "s", "t"};

// Surface displaced outwards by `height`, a formula of kHeightVariables; missing texture coordinates are 0.
// Vertices at one position stay together: the first gives the height, the mean of their normals the
// direction. New normals are means over the adjacent triangles; creases are kept. Throws Error at the vertex
// where the height has no value.
Surface displaced(const Surface& surface, const warp::Expression& height);

// Surface after a warp: positions Psi(p), tangents J t, normals along J^-T n; orientation is restored if the
// warp mirrors. The result is typed as the rest surface: capture and script share one world. J is exact, or
// by central differences with differenceStep(). Throws Error at the vertex where the warp has no value.
Surface deformed(const Surface& rest, const warp::Warp& warp);

} // namespace surflect::stage
