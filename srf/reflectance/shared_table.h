// A table shared by surfels of one kind, and their gains, found in turn: the table from the photographs with
// given gains, then the gains from the table.
//
//   w_i = m r_i / (white^2 + max(y_i)^2),   r_i = 1 / (1 + (2 (y_i - x_i) / (0.1 white + x_i))^2)
//
// Symbols: w_i weight of a photograph in the fit (table_fit.h), m membership of its surfel, y_i reflectance,
// x_i its prediction in the round before; r_i Cauchy's weight [Holland 1977], the least of the channels: a
// reflection or flare that only one photograph shows counts little. In the first round r_i is 1. Each round
// begins with the table of the round before.
//
// [Holland 1977] Holland, Welsch: Robust regression using iteratively reweighted least-squares.
#pragma once

#include "srf/reflectance/gains.h"
#include "srf/reflectance/photographs.h"
#include "srf/reflectance/reflectance_table.h"
#include "srf/reflectance/table_fit.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::reflectance {

struct SharedTable {
  std::vector<Rgb> nodes;       // values of the stored nodes
  std::vector<Rgb> gains;       // #surfels, also of non-members
  std::vector<Rgb> predictions; // k_i T(x_i) of all photographs (#photographs)
};

// Places of photographs in a grid (#photographs).
std::vector<TablePlace> placesOf(const TableGrid& grid, std::span<const HalfDifference<>> directions);

// Predictions k_i T(x_i), not below 0, of all photographs by a table (#photographs).
std::vector<Rgb> predictionsOf(const TableGrid& grid, std::span<const Rgb> nodes,
                               const Photographs& photographs, std::span<const TablePlace> places);

// Fits a table to the members' photographs, and the gains of all surfels to the table. membership: weight of
// each surfel in the fit, 0..1 (#surfels). rounds > 0, further ones to those of `start` if it has nodes.
// Throws Cancelled.
SharedTable fitSharedTable(const TableGrid& grid, const Photographs& photographs,
                           std::span<const TablePlace> places, std::span<const float> membership,
                           const FitOptions& options, size_t rounds = 3, const Progress& progress = {},
                           SharedTable start = {});

} // namespace surflect::reflectance
