// Radiance of light field maps at a place of the surface, in double precision: the equations that the OpenGL
// renderer is measured against.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/edge_corrections.h"
#include "render/lightfield/lfm/maps.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::lfm {

// A number for each channel of light field maps.
using Channels = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;

// Place of a triangle by barycentrics of its corners 1 and 2.
struct TrianglePlace {
  size_t triangle = 0;
  double b = 0, c = 0;
};

// All maps below must have the coding `bytes`. `edges` are edgeCorrections() of the maps; none for maps that
// agree on edges.

// Values of the surface map of a term at a place, of all three corners, times their hat functions.  hat g of
// maps.h
Vec3<double> surfaceValues(const LightFieldMaps& maps, size_t term, const TrianglePlace& place,
                           const EdgeCorrections& edges = {});
// View map of a term and vertex at a point of the vertex's disc.  h of maps.h
Channels viewValue(const LightFieldMaps& maps, size_t term, uint32_t vertex, const DiscPoint& point);
// Mean root over view directions.
Channels meanValue(const LightFieldMaps& maps, const TrianglePlace& place, const EdgeCorrections& edges = {});

// One approximation term: the sum over the triangle's corners of s hat g h.  [Chen 2002, Eq. 6]
// points: the direction to the viewer as each corner has it.
Channels termValue(const LightFieldMaps& maps, size_t term, const TrianglePlace& place,
                   const std::array<DiscPoint, 3>& points, const EdgeCorrections& edges = {});

// Radiance in the unit direction d to the viewer, by the mean and the first `terms` terms.
// [Chen 2002, Eqs. 3 and 6]  A fourth channel is the square of its root as well.
Channels radianceAt(const LightFieldMaps& maps, const TrianglePlace& place, const Direction& d, size_t terms,
                    const EdgeCorrections& edges = {});

} // namespace surflect::lfm
