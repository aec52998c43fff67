// A doll-like solid whose outline and surface have closed forms: axis-aligned ellipsoids, some of which
// intersect. One unit high, standing on z = 0 and facing -y.
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

// Implicit function |(p - center) / radii|^2 - 1: negative inside the ellipsoid, 0 on it.
double excessOf(const Ellipsoid& part, const Vec3<double>& p);

// Mesh of all parts, without triangles inside other parts; each part has 2 segments^2 triangles. Vertices lie
// on the ellipsoids, so that the mesh is slightly smaller.
TriangleMesh dollMesh(int segments);

struct DollHit {
  double distance;
  Vec3<double> normal; // unit, outwards
};
// First entry of a ray into a part. The origin must be outside of all parts.
std::optional<DollHit> firstHit(const Vec3<double>& origin, const Vec3<double>& direction);

// Mask of the pixels, row by row, whose rays through the centre meet the doll. The camera is a pinhole
// without distortion, outside of the doll. In every row, an ellipsoid covers one run of pixels, whose ends
// solve a quadratic equation.
std::vector<uint8_t> dollOutline(const capture::Camera<AcquisitionSpace>& camera);

} // namespace surflect::bench
