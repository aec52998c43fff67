#include "tests/stability/entry.h"

#include "render/lightfield/lfm/delaunay.h"
#include "render/lightfield/lfm/view_blend.h"
#include "render/lightfield/spherical/pencil_weights.h"
#include "tests/support/random.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace surflect::stability {
namespace {

using lfm::DiscPoint;

// Cells of the disc of a vertex without weights that sum to 1. Naive: a cell has weights in a triangle of
// views alone.
Measured emptyCells(const std::vector<DiscPoint>& views) {
  const lfm::ViewGrid grid(16);
  const lfm::SiteMesh mesh = lfm::siteMesh(views);
  const std::vector<lfm::CellBlend> blends = lfm::cellBlends(mesh, views, grid);
  Measured count;
  for (size_t cell = 0; cell < grid.cells(); ++cell) {
    if (!grid.isInDisc(cell)) continue;
    const DiscPoint c = grid.center(cell);
    const auto side = [&](const DiscPoint& a, const DiscPoint& b) {
      return (double{b.x()} - double{a.x()}) * (double{c.y()} - double{a.y()}) -
             (double{b.y()} - double{a.y()}) * (double{c.x()} - double{a.x()});
    };
    count.naive += std::ranges::none_of(mesh.triangles, [&](const auto& t) {
      return side(views[t[0]], views[t[1]]) >= 0 && side(views[t[1]], views[t[2]]) >= 0 &&
             side(views[t[2]], views[t[0]]) >= 0;
    });
    const auto& weights = blends[cell].weights;
    count.ours += !(std::abs(double{weights[0]} + double{weights[1]} + double{weights[2]} - 1) < 1e-5);
  }
  return count;
}

// Levels of detail beyond the finest that a continuous level asks for. Naive: floor(detail) and the next.
Measured missingLevels(double detail, size_t levels) {
  Measured count;
  count.naive = std::floor(detail) + 1 >= static_cast<double>(levels) ? 1 : 0;
  double sum = 0;
  for (const auto& [level, weight] : spherical::levelShares(detail, levels)) {
    sum += weight;
    count.ours += weight > 0 && level >= levels;
  }
  count.ours += !(std::abs(sum - 1) < 1e-12);
  return count;
}

// Largest change of a pencil's weight as a direction crosses the sides of pencils, in steps of 1e-3 rad.
Measured pencilJumps() {
  const spherical::DirectionTree tree(4);
  Measured jump;
  std::map<uint32_t, double> lastNaive, lastOurs;
  for (int step = 0; step < 3000; ++step) {
    const double turn = 1e-3 * step;
    const Vec3<double> direction = Vec3<double>(std::cos(turn), 0.3, std::sin(turn)).normalized();
    const auto weights = [&](bool interpolated) {
      std::map<uint32_t, double> by;
      for (const auto& share : spherical::pencilShares(tree, 3, direction, interpolated))
        by[share.pencil.index] += share.weight;
      return by;
    };
    const auto naive = weights(false), ours = weights(true);
    const auto largest = [](const std::map<uint32_t, double>& a, std::map<uint32_t, double> b) {
      for (const auto& [index, weight] : a) b[index] -= weight;
      double most = 0;
      for (const auto& [index, change] : b) raise(most, std::abs(change));
      return most;
    };
    if (step > 0) raise(jump.naive, largest(naive, lastNaive)), raise(jump.ours, largest(ours, lastOurs));
    lastNaive = naive, lastOurs = ours;
  }
  return jump;
}

} // namespace

Group lightFieldGroup() {
  return {
      "Light fields",
      "cells in triangles of views alone; levels floor(d) and the next; the pencil of a direction alone",
      {
          {"vertex that one view sees", "it answers for all cells", "cells without weights", 0,
           [] {
             return emptyCells({{0.4f, 0.5f}});
           }},
          {"vertex with two views", "the nearest point between them", "cells without weights", 0,
           [] {
             return emptyCells({{0.3f, 0.5f}, {0.6f, 0.4f}});
           }},
          {"vertex with five views on a line", "the nearest point of the line", "cells without weights", 0,
           [] {
             return emptyCells({{0.2f, 0.5f}, {0.3f, 0.5f}, {0.4f, 0.5f}, {0.5f, 0.5f}, {0.7f, 0.5f}});
           }},
          {"vertex with the same view twice", "cells have weights", "cells without weights", 0,
           [] {
             return emptyCells({{0.3f, 0.5f}, {0.3f, 0.5f}, {0.6f, 0.7f}, {0.5f, 0.2f}});
           }},
          {"level of detail at the finest", "the finest level alone", "levels that do not exist", 0,
           [] { return missingLevels(3, 4); }},
          {"a direction across the sides of pencils", "weights change by as little as it",
           "largest change in 0.001 rad", 0.02, pencilJumps},
      }};
}

} // namespace surflect::stability
