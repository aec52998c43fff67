// Radiance of a point towards a viewer, interpolated between the pictures of a lumigraph's nodes.
//
// [Gortler 1996] Gortler, Grzeszczuk, Szeliski, Cohen: The Lumigraph, depth correction.
// Symbols: P point of the geometry, C viewer, N_n nodes around the line P C on the st plane, c_n and a_n
// colour and alpha where the line from N_n to P crosses the uv plane, w_n weights.
//
//   w_n = slab weight x bilinear weight of (s, t) between nodes; their sum is 1
//   colour = sum_n w_n (a_n + f) c_n / sum_n w_n (a_n + f)
//   alpha = 1 if the geometry has the object's outline, else sum_n w_n a_n
//
// f is small: a node whose line to P misses the object has a colour that was filled in, which must count only
// where the lines of all nodes miss the object.
#pragma once

#include "render/lightfield/lumigraph/slab.h"

#include <Eigen/Core>

#include <cstddef>
#include <vector>

namespace surflect::lumigraph {

inline constexpr double kFilledWeight = 1e-3; // f

// A place in a node's picture, in texels, and its weight.
struct Tap {
  size_t slab = 0;
  int i = 0, j = 0;
  double u = 0, v = 0;
  double weight = 0;
};

// Taps for P seen from C, at most twelve; empty if P is C. Weights are positive and sum to 1. Beyond the
// grid's edge the nearest nodes count.
std::vector<Tap> tapsAt(const Slabs& slabs, double overlap, const Point& p, const Point& viewer);

// Colour and alpha at a place of a node's picture, bilinear between texel centres. Beyond the centres of the
// outermost texels it is constant.
Eigen::Vector4d textureAt(const Lumigraph& lumigraph, const Tap& tap);

// Premultiplied RGBA of P seen from C; 0 if P is C.
Eigen::Vector4d radianceAt(const Lumigraph& lumigraph, const Point& p, const Point& viewer);

} // namespace surflect::lumigraph
