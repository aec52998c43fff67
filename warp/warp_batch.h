// Batch of points that pass through a warp.
#pragma once

namespace surflect::warp {

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

} // namespace surflect::warp
