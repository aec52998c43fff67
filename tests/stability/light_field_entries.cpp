#include "tests/stability/entry.h"

#include "render/lightfield/lfm/view_blend.h"
#include "render/lightfield/olf/bsp_tree.h"
#include "render/lightfield/slf/resample.h"
#include "render/lightfield/slf/unseen_texels.h"
#include "render/lightfield/spherical/pencil_weights.h"
#include "srf/image/half_float.h"
#include "tests/support/random.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>
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

// Three bars in a ring, each over the next at one end and under the one before at the other.
TriangleMesh ringOfBars() {
  TriangleMesh mesh;
  for (int bar = 0; bar < 3; ++bar) {
    const Eigen::AngleAxisd turn(2 * std::numbers::pi * bar / 3, Vec3<double>::UnitZ());
    for (const Vec3<double>& corner :
         {Vec3<double>(-1, 0.4, -0.2), {1, 0.4, 0.2}, {1, 0.6, 0.2}, {-1, 0.6, -0.2}})
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(Vec3<float>((turn * corner).cast<float>())));
    const auto first = static_cast<uint32_t>(4 * bar);
    mesh.triangles.push_back({first, first + 1, first + 2});
    mesh.triangles.push_back({first, first + 2, first + 3});
  }
  return mesh;
}

// Whole triangles, furthest middle first.
std::vector<uint32_t> byMiddles(const std::vector<olf::Piece>& whole, const Vec3<double>& viewer) {
  std::vector<uint32_t> order(whole.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, std::greater(), [&](uint32_t i) {
    const auto& corners = whole[i].corners;
    return ((corners[0] + corners[1] + corners[2]) / 3 - viewer).norm();
  });
  return order;
}

// Distance along a ray at which it meets a piece.
std::optional<double> distanceTo(const olf::Piece& piece, const Vec3<double>& viewer,
                                 const Vec3<double>& direction) {
  const auto& [a, b, c] = piece.corners;
  Mat3<double> edges;
  edges << b - a, c - a, -direction;
  const Vec3<double> at = edges.inverse() * (viewer - a); // barycentrics, then distance
  if (!(at[0] > 0 && at[1] > 0 && at[0] + at[1] < 1)) return std::nullopt;
  return at[2];
}

// The ring of bars, painted back to front. Naive: whole triangles in the order of their middles. Truth: the
// nearest piece along each ray.
Pictures barPictures(int size) {
  const TriangleMesh mesh = ringOfBars();
  const Vec3<double> viewer(0, 0, 5);
  constexpr int kRays = 4; // for each pixel, along each side
  const std::vector<olf::Piece> whole = olf::wholePieces(mesh);
  const olf::BspTree tree(mesh);
  const auto painted = [&](const std::vector<olf::Piece>& pieces, const std::vector<uint32_t>& order,
                           bool isNearest) {
    image::Image picture(size, size, 4);
    for (int y = 0; y < size * kRays; ++y)
      for (int x = 0; x < size * kRays; ++x) {
        const double unit = 2.4 / (size * kRays);
        const Vec3<double> direction =
            Vec3<double>((x + 0.5) * unit - 1.2, 1.2 - (y + 0.5) * unit, 0) - viewer;
        std::optional<size_t> bar;
        double nearest = std::numeric_limits<double>::infinity();
        for (const uint32_t index : order)
          if (const auto distance = distanceTo(pieces[index], viewer, direction);
              distance && (!isNearest || *distance < nearest))
            bar = pieces[index].triangle / 2, nearest = *distance;
        if (!bar) continue;
        const auto pixel = picture.at(x / kRays, y / kRays);
        for (const size_t channel : {*bar, size_t{3}}) pixel[channel] += 1.f / (kRays * kRays);
      }
    return picture;
  };
  const auto order = byMiddles(whole, viewer);
  return {painted(whole, order, false), painted(tree.pieces(), tree.backToFront(viewer), false),
          painted(whole, order, true)};
}

// Share of the rays through two bars on which the further one is drawn over the nearer one. Naive: whole
// triangles by the distance of their middles.
Measured wronglyOrdered() {
  const TriangleMesh mesh = ringOfBars();
  const Vec3<double> viewer(0, 0, 5);
  const auto share = [&](const std::vector<olf::Piece>& pieces, const std::vector<uint32_t>& order) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    int throughTwo = 0, wrong = 0;
    for (int ray = 0; ray < 20000; ++ray) {
      const Vec3<double> direction = Vec3<double>(uniform(random), uniform(random), 0) - viewer;
      double last = std::numeric_limits<double>::infinity();
      int hits = 0;
      bool isWrong = false;
      for (const uint32_t index : order) {
        const auto distance = distanceTo(pieces[index], viewer, direction);
        if (!distance) continue;
        isWrong = isWrong || *distance > last + 1e-9;
        ++hits;
        last = *distance;
      }
      throughTwo += hits > 1, wrong += isWrong;
    }
    return static_cast<double>(wrong) / throughTwo;
  };
  const std::vector<olf::Piece> whole = olf::wholePieces(mesh);
  const olf::BspTree tree(mesh);
  return {share(whole, byMiddles(whole, viewer)), share(tree.pieces(), tree.backToFront(viewer))};
}

// Largest error of the mean of regions in a row that no view sees, between two seen ones of radiance 0.4 and
// 0.6, against a linear course. Naive: black.
Measured unseenRegions(size_t unseen) {
  constexpr int kSide = 8;
  slf::Field field;
  field.directionMeshes.emplace_back(slf::octahedronDirections(0));
  const slf::DirectionMesh& base = field.directionMeshes[0];
  std::vector<slf::Chart> charts;
  for (uint32_t i = 0; i < unseen + 3; ++i)
    for (const float y : {0.f, 1.f}) field.mesh.positions.emplace_back(static_cast<float>(i), y, 0.f);
  for (uint32_t i = 0; i < unseen + 2; ++i) {
    slf::Chart& chart = charts.emplace_back();
    chart.vertices = {2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1};
    chart.coordinates = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    chart.triangles = {{0, 1, 2}, {0, 2, 3}};
    chart.width = chart.height = kSide;
    for (const auto& [a, b, c] : chart.triangles) {
      chart.meshTriangles.push_back(static_cast<uint32_t>(field.mesh.triangles.size()));
      field.mesh.triangles.push_back({chart.vertices[a], chart.vertices[b], chart.vertices[c]});
    }
    field.regions.push_back({chart, 0});
  }
  std::vector<slf::SeenRegion> seen(charts.size(), {std::vector<uint8_t>(base.directions().size(), 1),
                                                    std::vector<bool>(kSide * kSide, false)});
  seen.front().isSeen.assign(kSide * kSide, true);
  seen.back().isSeen.assign(kSide * kSide, true);
  Measured error;
  const auto read = [&](size_t region, size_t) {
    return std::vector<slf::Texel>(kSide * kSide,
                                   slf::texelOf(Vec3<float>::Constant(region == 0 ? 0.4f : 0.6f), true));
  };
  const auto measure = [&](size_t region, size_t, std::span<const slf::Texel> texels) {
    double mean = 0;
    for (const slf::Texel& texel : texels)
      mean += double{image::floatOfHalf(texel[0])} / static_cast<double>(texels.size());
    const double wanted = 0.4 + 0.2 * static_cast<double>(region) / static_cast<double>(unseen + 1);
    raise(error.naive, wanted);
    raise(error.ours, std::abs(mean - wanted));
  };
  slf::fillUnseenTexels(field, seen, base, slf::borderPoints(field.mesh, charts, 1.0 / kSide),
                        {read, measure});
  return error;
}

} // namespace

Group lightFieldGroup() {
  return {
      "Light fields",
      "cells in triangles of views alone; levels floor(d) and the next; the pencil of a direction alone; "
      "whole "
      "triangles in the order of their middles; black where no view sees",
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
          {"three bars, each over the next: a cyclic depth order", "triangles are cut until an order exists",
           "share of rays in a wrong order", 0, wronglyOrdered},
          {"a region no view sees, between two that are seen", "their mean", "error of radiance", 3e-5,
           [] { return unseenRegions(1); }},
          {"five such regions in a row", "a course between both ends", "error of radiance", 0.1,
           [] { return unseenRegions(5); }},
      },
      {{"bars", [] { return barPictures(144); }}}};
}

} // namespace surflect::stability
