#include "srf/reflectance/reflectance_table.h"

#include <cassert>

namespace surflect::reflectance {

namespace {

constexpr float kGreatestHalf = 65504;

// Cell and fraction of a coordinate of -1..1 along `nodes` nodes.
struct Division {
  uint32_t cell;
  float fraction;
};
Division divide(float coordinate, uint32_t nodes) {
  if (nodes == 1) return {0, 0};
  const float last = static_cast<float>(nodes - 1);
  const float at = std::clamp(last / 2 * (1 + coordinate), 0.f, last);
  const uint32_t cell = std::min(static_cast<uint32_t>(at), nodes - 2);
  return {cell, at - static_cast<float>(cell)};
}

// T of the mixture. The corners of the cell are those of each table.
Rgb lookUp(const ReflectanceTables& tables, const TableMixture& mixture, const TablePlace& place) {
  const TableCorners corners = cornersOf(tables.grid, place);
  Eigen::Array4f mixed = Eigen::Array4f::Zero();
  for (size_t m = 0; m < kMixedTables; ++m) {
    if (mixture.weight[m] == 0) continue;
    const TableNode* nodes = tables.values.data() + size_t{mixture.table[m]} * tables.grid.size();
    const auto value = [&](size_t corner) {
      return Eigen::Map<const Eigen::Array4f, Eigen::Aligned16>(&nodes[corners.index[corner]].r);
    };
    Eigen::Array4f sum = Eigen::Array4f::Zero();
    for (size_t c = 0; c < corners.index.size(); c += 4) // four short sums, which do not wait for one another
      sum += corners.weight[c] * value(c) + corners.weight[c + 1] * value(c + 1) +
             (corners.weight[c + 2] * value(c + 2) + corners.weight[c + 3] * value(c + 3));
    mixed += mixture.weight[m] * sum.max(0.f);
  }
  return {mixed[0], mixed[1], mixed[2]};
}

} // namespace

TablePlace placeOf(const TableGrid& grid, const HalfDifference<>& at) {
  // The mirror image with positive u is looked up.
  const bool isMirrored = at.halfU < 0 || (at.halfU == 0 && at.halfV < 0);
  const float sign = isMirrored ? -1.f : 1.f;
  const Division u = divide(stretchedHalf(sign * at.halfU), grid.nodes[0]);
  const Division v = divide(stretchedHalf(sign * at.halfV), grid.nodes[1]);
  const Division k = divide(at.differenceU, grid.nodes[2]), l = divide(at.differenceV, grid.nodes[3]);
  return {static_cast<uint16_t>(u.cell * grid.nodes[1] + v.cell),
          static_cast<uint16_t>(k.cell * grid.nodes[3] + l.cell),
          {u.fraction, v.fraction, k.fraction, l.fraction}};
}

Rgb lookUpNodes(const TableGrid& grid, std::span<const Rgb> nodes, const TablePlace& place) {
  assert(nodes.size() == grid.size());
  const TableCorners corners = cornersOf(grid, place);
  Rgb sum;
  for (size_t c = 0; c < corners.index.size(); ++c) sum = sum + corners.weight[c] * nodes[corners.index[c]];
  return sum;
}

// Sum over all nodes of the whole grid, mirror images included, each with its hat function.
std::array<double, 3> lookUpReference(const TableGrid& grid, std::span<const Rgb> nodes,
                                      const HalfDifference<double>& at) {
  const std::array<double, 4> coordinates{stretchedHalf(at.halfU), stretchedHalf(at.halfV), at.differenceU,
                                          at.differenceV};
  const auto hat = [&](size_t axis, uint32_t node) {
    if (grid.nodes[axis] == 1) return 1.0;
    const double spacing = 2.0 / (grid.nodes[axis] - 1);
    const double distance = std::abs(std::clamp(coordinates[axis], -1.0, 1.0) - (node * spacing - 1));
    return std::max(0.0, 1 - distance / spacing);
  };
  std::array<double, 3> sum{};
  for (uint32_t i = 0; i < grid.nodes[0]; ++i)
    for (uint32_t j = 0; j < grid.nodes[1]; ++j)
      for (uint32_t k = 0; k < grid.nodes[2]; ++k)
        for (uint32_t l = 0; l < grid.nodes[3]; ++l) {
          const Rgb& node = nodes[grid.indexOf(i * grid.nodes[1] + j, k * grid.nodes[3] + l)];
          const double weight = hat(0, i) * hat(1, j) * hat(2, k) * hat(3, l);
          sum[0] += weight * node.r;
          sum[1] += weight * node.g;
          sum[2] += weight * node.b;
        }
  return sum;
}

void ReflectanceTables::add(std::span<const Rgb> nodes) {
  assert(nodes.size() == grid.size());
  const auto rounded = [](float value) {
    return static_cast<float>(Eigen::half(std::clamp(value, -kGreatestHalf, kGreatestHalf)));
  };
  for (const auto& [r, g, b] : nodes) values.push_back({rounded(r), rounded(g), rounded(b)});
}

std::vector<Rgb> ReflectanceTables::nodes(size_t table) const {
  std::vector<Rgb> all;
  for (const TableNode& node : std::span(values).subspan(table * grid.size(), grid.size()))
    all.push_back({node.r, node.g, node.b});
  return all;
}

void predictReflectance(const ReflectanceTables& tables, const TableMixture& mixture,
                        std::span<const Direction3<SurfelSpace>> towardsView,
                        std::span<const Direction3<SurfelSpace>> towardsLight, std::span<Rgb> reflectance) {
  assert(towardsView.size() == reflectance.size() && towardsLight.size() == reflectance.size());
  for (size_t q = 0; q < reflectance.size(); ++q) {
    const TablePlace place = placeOf(tables.grid, halfDifference(towardsView[q], towardsLight[q]));
    reflectance[q] = tableLink(towardsLight[q].z(), towardsView[q].z()) * lookUp(tables, mixture, place);
  }
}

} // namespace surflect::reflectance
