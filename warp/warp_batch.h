// Points on their way through a warp, many at once.
#pragma once

namespace surflect::warp {

// Places, the tangents u and v there, and the determinant of the Jacobian so far; structure of arrays, one
// entry a point in the first `count` of each. What is beyond may be computed with but means nothing.
struct WarpBatch {
  static constexpr int capacity = 128; // fits the first cache; a multiple of all lanes
  int count = 0;
  alignas(64) double x[capacity], y[capacity], z[capacity];
  alignas(64) double ux[capacity], uy[capacity], uz[capacity];
  alignas(64) double vx[capacity], vy[capacity], vz[capacity];
  alignas(64) double determinant[capacity];
};

} // namespace surflect::warp
