// A doll-like solid whose outline and surface have closed forms: ellipsoids along the axes, some of which
// meet. One unit high, standing on z = 0, looking along -y.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/geometry/mesh.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect::bench {

struct Ellipsoid {
  Vec3<double> center, radii;
};

std::span<const Ellipsoid> dollParts();

// Negative inside of the ellipsoid, 0 on it: |(p - center) / radii|^2 - 1.
double excessOf(const Ellipsoid& part, const Vec3<double>& p);

// The surface of all parts but for triangles inside of another; each part has 2 segments^2 triangles. Corners
// lie on the ellipsoids, so that the mesh is a little smaller.
TriangleMesh dollMesh(int segments);

struct DollHit {
  double distance;
  Vec3<double> normal; // unit, outwards
};
// The point where a ray first enters a part. The origin is outside of all parts.
std::optional<DollHit> firstHit(const Vec3<double>& origin, const Vec3<double>& direction);

// Per pixel, row by row: does the ray through its centre meet the doll? Of a pinhole without distortion
// outside of the doll. Every row of an ellipsoid's outline is one run of pixels, whose ends solve a quadratic
// equation.
std::vector<uint8_t> dollOutline(const capture::Camera<AcquisitionSpace>& camera);

} // namespace surflect::bench
