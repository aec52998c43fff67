// Reflectance tables: reflectance of a kind of surface, measured over all pairs of directions to light and
// viewer, on a grid of the four coordinates of table_coordinates.h.
//
//   T(p, e) = sum over the 16 corners of the cell   prod_i (1 - f_i or f_i)  T_corner          (multilinear)
//   a = 3 p / (1 + 2 |p|)
//
// Symbols: a coordinates of the grid along p, evenly divided: at the mirror direction p = 0 the grid is three
// times as fine as an even one, at the horizon a third as fine. e is divided evenly. f_i place within the
// cell.
//
// T(p, e) = T(-p, e): fibres have a direction but no sign, so that nothing may change when the frame of a
// surfel makes half a turn about its normal. Of a node and its mirror image, one is stored.
#pragma once

#include "srf/reflectance/table_coordinates.h"
#include "surfel/math/rgb.h"

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::reflectance {

// a of p; odd, and 1 at 1.
template <class T> T stretchedHalf(T p) { return 3 * p / (1 + 2 * std::abs(p)); }

// Grid of a table. Nodes along half u, half v, difference u and difference v, from -1 to 1: odd numbers, with
// at most 2^16 nodes of p and of e. A coordinate with one node does not count.
struct TableGrid {
  std::array<uint32_t, 4> nodes{33, 33, 7, 7};

  uint32_t halves() const { return (nodes[0] * nodes[1] + 1) / 2; } // stored nodes of p
  uint32_t differences() const { return nodes[2] * nodes[3]; }      // nodes of e
  uint32_t size() const { return halves() * differences(); }

  // Index of the stored node for node `half` = i nodes[1] + j of p, and node `difference` = k nodes[3] + l of
  // e.
  uint32_t indexOf(uint32_t half, uint32_t difference) const {
    const uint32_t last = nodes[0] * nodes[1] - 1;
    return (std::max(half, last - half) - last / 2) * differences() + difference;
  }

  friend bool operator==(const TableGrid&, const TableGrid&) = default;
};

// Place in a grid: the first corner of its cell, as the arguments of TableGrid::indexOf, and the place within
// the cell, 0..1 along each coordinate.
struct TablePlace {
  uint16_t half = 0, difference = 0;
  std::array<float, 4> fraction{};
};

// p and -p have the same place. Coordinates outside of -1..1 are clamped.
TablePlace placeOf(const TableGrid& grid, const HalfDifference<>& at);

// Corners of a cell, with their multilinear weights, which sum to 1.
struct TableCorners {
  std::array<uint32_t, 16> index;
  std::array<float, 16> weight;
};
inline std::array<float, 16> cornerWeights(const std::array<float, 4>& f) {
  const std::array<float, 4> ofHalf{(1 - f[0]) * (1 - f[1]), (1 - f[0]) * f[1], f[0] * (1 - f[1]),
                                    f[0] * f[1]};
  const std::array<float, 4> ofDifference{(1 - f[2]) * (1 - f[3]), (1 - f[2]) * f[3], f[2] * (1 - f[3]),
                                          f[2] * f[3]};
  std::array<float, 16> weights;
  for (size_t h = 0; h < 4; ++h)
    for (size_t e = 0; e < 4; ++e) weights[4 * h + e] = ofHalf[h] * ofDifference[e];
  return weights;
}
inline TableCorners cornersOf(const TableGrid& grid, const TablePlace& place) {
  const auto step = [&](size_t axis) { return grid.nodes[axis] > 1 ? 1u : 0u; };
  TableCorners corners{{}, cornerWeights(place.fraction)};
  for (uint32_t h = 0; h < 4; ++h)
    for (uint32_t e = 0; e < 4; ++e)
      corners.index[4 * h + e] =
          grid.indexOf(place.half + h / 2 * step(0) * grid.nodes[1] + h % 2 * step(1),
                       place.difference + e / 2 * step(2) * grid.nodes[3] + e % 2 * step(3));
  return corners;
}

inline Rgb positive(const Rgb& value) {
  return {std::max(0.f, value.r), std::max(0.f, value.g), std::max(0.f, value.b)};
}

// T in full precision, from the values of all stored nodes (#grid.size()).
Rgb lookUpNodes(const TableGrid& grid, std::span<const Rgb> nodes, const TablePlace& place);

// Reference of placeOf, cornersOf and lookUpNodes: the definition, in double precision.
std::array<double, 3> lookUpReference(const TableGrid& grid, std::span<const Rgb> nodes,
                                      const HalfDifference<double>& at);

// Value of a node, for vectors of four.
struct alignas(16) TableNode {
  float r = 0, g = 0, b = 0, unused = 0;

  friend bool operator==(const TableNode&, const TableNode&) = default;
};

// Tables of one grid in one piece, with the precision of half floats.
struct ReflectanceTables {
  TableGrid grid;
  std::vector<TableNode> values; // node by node; table by table

  size_t count() const { return values.size() / grid.size(); }
  // Adds a table (#grid.size()), rounded to half floats; values beyond the greatest are clamped.
  void add(std::span<const Rgb> nodes);
  // Values of all stored nodes of a table.
  std::vector<Rgb> nodes(size_t table) const;
};

// Mixture of tables at a surfel. Weights sum to 1; a table of weight 0 has no effect.
inline constexpr size_t kMixedTables = 3;
struct TableMixture {
  std::array<uint16_t, kMixedTables> table{};
  std::array<float, kMixedTables> weight{1};
};

// Reflectance of queries at one surfel by the tables, without its gain: k T, with T the mixture of the
// tables' values, each not below 0, and k the link of table_coordinates.h. All spans have one entry a query.
// Costs 16 reads of a node a query and table of its mixture.
void predictReflectance(const ReflectanceTables& tables, const TableMixture& mixture,
                        std::span<const Direction3<SurfelSpace>> towardsView,
                        std::span<const Direction3<SurfelSpace>> towardsLight, std::span<Rgb> reflectance);

} // namespace surflect::reflectance
