// Surfel clouds, at rest and after a warp. Structures of arrays: all vectors have one entry per surfel.
#pragma once

#include "surfel/tangent_frame.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect {

// Surfels at rest.  [Weyrich 2005, Table 1]
struct SurfelCloud {
  std::vector<Point3<AcquisitionSpace>> p0;
  std::vector<Rodrigues> r0; // tangent frame (u0, v0, n0)
  std::vector<float> radius; // splat radius, scene units; discs of this radius leave no hole
  std::vector<float>
      coverage; // peak of its Gaussian; the cloud's Gaussians add up to about 1, less at borders

  size_t size() const { return p0.size(); }
};

// Effect of a warp on a surfel: kept or mirrored, or dead if it has no frame.
enum class Handedness : int8_t { dead = 0, kept = 1, mirrored = -1 };

struct DeformedCloud {
  std::vector<Point3<ObjectSpace>> p;
  std::vector<Direction3<ObjectSpace>> u, v; // warped u0, v0: neither unit nor orthogonal
  std::vector<Handedness> handedness;        // dead surfels have no frame and are not drawn

  size_t size() const { return p.size(); }
};

} // namespace surflect
