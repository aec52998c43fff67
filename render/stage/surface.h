// Surfaces that stand in the light stage: meshes with a shading frame at each vertex, and what is done to any
// of them.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/math/angle.h"
#include "warp/expression.h"
#include "warp/warp.h"

#include <vector>

namespace surflect::stage {

// Of one stage.
constexpr size_t kMostTriangles = size_t{1} << 25;
// Throws Error.
void requireFewTriangles(size_t count);

// Of each coordinate, as in a stage file.
constexpr float kFarthest = 1e9f;

struct Surface {
  TriangleMesh mesh; // counter-clockwise seen from outside
  // One a vertex, of any length; 0 where there is none. Tangents run along the fibre of what has one.
  std::vector<Direction3<AcquisitionSpace, double>> normals, tangents;
  // Where on a texture each vertex is, (0, 0) to (1, 1). Empty where nobody has said.
  std::vector<Vec2<double>> textureCoordinates;
};

// Single precision may have flattened every triangle, or put a vertex beyond all numbers. Throws Error.
void requireVisible(const Surface& surface);

// Adds the other surface's triangles. Both have texture coordinates, or neither, or `surface` is empty.
void append(Surface& surface, const Surface& other);

// x -> linear x + offset. Turned inside out again where that mirrors.
Surface transformed(const Surface& surface, const Mat3<double>& linear, const Vec3<double>& offset);

// Tangents turned about the normals, counter-clockwise seen from outside.
Surface withTangentsTurned(const Surface& surface, Angle angle);

// Texture coordinates by projection along z: a square round the surface, (1, 1) where x and y are largest.
Surface withPlanarTexture(const Surface& surface);

// The variables of a height: position and texture coordinates, as `displaced` finds them.
constexpr std::string_view kHeightVariables[] = {"x", "y", "z", "s", "t"};

// Moved outwards by `height`, a formula of kHeightVariables; 0 for coordinates that are not there. Vertices
// at one place stay together: the first of them says how far, the mean of their normals says where to.
// Normals are means over the triangles round a vertex, and creases stay. Throws Error at the vertex where the
// height has no value.
Surface displaced(const Surface& surface, const warp::Expression& height);

// The surface after the warp: positions Psi(p), tangents J t, normals along J^-T n; turned inside out again
// where the warp mirrors. The result stands in the stage as the rest surface did: capture and script share
// one world. J is exact, or by central differences with differenceStep(). Throws Error at the vertex where
// the warp has no value.
Surface deformed(const Surface& rest, const warp::Warp& warp);

} // namespace surflect::stage
