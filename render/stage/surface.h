// Surfaces that stand in the light stage: meshes with a shading frame at each vertex.
//
// Tangents run along the fibre of what has one. Shapes that are made here have z for their axis, and their
// tangents run round it, counter-clockwise seen from above.
#pragma once

#include "surfel/mesh.h"
#include "warp/warp.h"

#include <filesystem>
#include <vector>

namespace surflect {

struct Surface {
  TriangleMesh mesh; // counter-clockwise seen from outside
  // One a vertex, of any length; 0 where there is none.
  std::vector<Direction3<AcquisitionSpace, double>> normals, tangents;
  // Where on a texture each vertex is: (0, 0) to (1, 1) round and up a shape, and over each side of a box or
  // disc. Empty where nobody has said.
  std::vector<Vec2<double>> textureCoordinates;
};

// `segments` (3 or more) triangles' sides round the axis, half as many from pole to pole.
Surface sphere(const Point3<AcquisitionSpace, double>& center, double radius, int segments);

// A sphere of radius rho(d) = radius (1 + amplitude sin(f d_x) sin(f d_y) sin(f d_z)) in direction d, with
// the normals of that shape. amplitude is below 1.
Surface bumpySphere(const Point3<AcquisitionSpace, double>& center, double radius, double amplitude,
                    double frequency, int segments);

// Closed by discs.
Surface cylinder(const Point3<AcquisitionSpace, double>& center, double radius, double height, int segments);

// Each face has segments x segments squares and one normal; tangents of upright faces are horizontal.
Surface box(const Point3<AcquisitionSpace, double>& center, const Vec3<double>& size, int segments);

// Throws Error as readMesh does. Smooth: normals are means over the triangles that share a vertex; else each
// triangle has its own. Tangents run round z.
Surface readSurface(const std::filesystem::path& path, bool smooth);

// The surface after the warp: positions Psi(p), tangents J t, normals along J^-T n; turned inside out again
// where the warp mirrors. The result stands in the stage as the rest surface did: capture and script share
// one world. J is exact, or by central differences with differenceStep(). Throws Error at the vertex where
// the warp has no value.
Surface deformed(const Surface& rest, const Warp& warp);

} // namespace surflect
