#include "render/lightfield/lfm/rings.h"

#include "surfel/base/error.h"
#include "surfel/geometry/mesh_topology.h"

#include <algorithm>
#include <cassert>
#include <map>
#include <string>
#include <utility>

namespace surflect::lfm {

PatchGrid::PatchGrid(int samplesPerEdge) : n_(samplesPerEdge) {
  if (samplesPerEdge < 2 || samplesPerEdge > kMostPerEdge)
    throw Error::mismatch("2 to " + std::to_string(kMostPerEdge), std::to_string(samplesPerEdge))
        .at("samples");
}

PatchPlace PatchGrid::place(size_t sample) const {
  int left = static_cast<int>(sample), j = 0;
  while (left >= n_ - j) left -= n_ - j++;
  return {left, j};
}

std::array<int, 3> PatchGrid::steps(size_t sample) const {
  const auto [i, j] = place(sample);
  return {n_ - 1 - i - j, i, j};
}

Vec3<double> PatchGrid::barycentrics(size_t sample) const {
  const auto [a, b, c] = steps(sample);
  return Vec3<double>(a, b, c) / (n_ - 1);
}

size_t PatchGrid::besideFarEdge(size_t sample, size_t corner) const {
  std::array<int, 3> to = steps(sample);
  assert(to[corner] == 0);
  int& second = to[(corner + 1) % 3];
  int& third = to[(corner + 2) % 3];
  ++to[corner];
  --(second >= third ? second : third);
  return index({to[1], to[2]});
}

int samplesPerEdgeFor(double pixels) {
  constexpr std::array kPerEdge{4, 6, 8, 12, 16, 24, 32};
  for (const int n : kPerEdge)
    if (static_cast<double>(PatchGrid::samples(n)) >= pixels) return n;
  return kPerEdge.back();
}

namespace {

void requireFinite(const TriangleMesh& mesh) {
  for (size_t v = 0; v < mesh.positions.size(); ++v)
    if (!mesh.positions[v].raw().allFinite())
      throw Error("is not finite").at("positions[" + std::to_string(v) + ']');
}

// Corners by the first vertex at each position.
std::vector<std::array<uint32_t, 3>> weldedCorners(const TriangleMesh& mesh,
                                                   const std::vector<uint32_t>& place) {
  std::vector<std::array<uint32_t, 3>> corners;
  corners.reserve(mesh.triangles.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::string field = "triangles[" + std::to_string(t) + ']';
    auto& [a, b, c] = corners.emplace_back(mesh.triangles[t]);
    for (uint32_t& corner : corners.back()) {
      if (corner >= place.size())
        throw Error::mismatch("a vertex below " + std::to_string(place.size()), std::to_string(corner))
            .at(field);
      corner = place[corner];
    }
    if (a == b || b == c || c == a)
      throw Error("has two corners at one position; expected a triangle with an area").at(field);
  }
  return corners;
}

Vec3<double> normalOf(const TriangleMesh& mesh, std::span<const RingTriangle> around) {
  constexpr double kCancelled = 1e-9; // relative to the summed areas
  Vec3<double> sum = Vec3<double>::Zero(), first = Vec3<double>::Zero();
  double areas = 0;
  for (const auto& [triangle, corner] : around) {
    const Vec3<double> area = areaVector(mesh, triangle);
    if (areas == 0) first = area;
    sum += area;
    areas += area.norm();
  }
  if (!(areas > 0)) return {0, 0, 1};
  return sum.norm() > kCancelled * areas ? sum : first;
}

} // namespace

Rings::Rings(const TriangleMesh& mesh, const Progress& progress) {
  requireFinite(mesh);
  corners_ = weldedCorners(mesh, firstAtPlace(mesh, progress));
  const size_t count = mesh.positions.size();
  first_.assign(count + 1, 0);
  for (const auto& corners : corners_)
    for (const uint32_t v : corners) ++first_[v + 1];
  for (size_t v = 0; v < count; ++v) first_[v + 1] += first_[v];
  triangles_.resize(first_.back());
  std::vector<size_t> next(first_.begin(), first_.end() - 1);
  for (uint32_t t = 0; t < corners_.size(); ++t)
    for (uint8_t corner = 0; corner < 3; ++corner) triangles_[next[corners_[t][corner]]++] = {t, corner};
  progress.checkpoint();

  frames_.resize(count);
  std::vector<uint8_t> isListed(count, 0);
  for (uint32_t start = 0; start < count; ++start) {
    if (around(start).empty()) continue;
    frames_[start] = frameAlong(normalOf(mesh, around(start)));
    if (isListed[start]) continue;
    // Breadth first over the start's part of the mesh.
    isListed[start] = 1;
    vertices_.push_back(start);
    for (size_t i = vertices_.size() - 1; i < vertices_.size(); ++i)
      for (const auto& [triangle, corner] : around(vertices_[i]))
        for (const uint32_t v : corners_[triangle])
          if (!std::exchange(isListed[v], uint8_t{1})) vertices_.push_back(v);
  }
}

RingRows ringRows(const Rings& rings, uint32_t vertex, const PatchGrid& grid) {
  const std::span<const RingTriangle> around = rings.around(vertex);
  RingRows result;
  result.rowOf.assign(around.size() * grid.samples(), RingRows::kNone);
  std::vector<std::vector<RingRows::Sample>> samples;
  std::map<std::pair<uint32_t, int>, uint32_t> onEdges; // row by the edge's other vertex and the steps there
  const auto newRow = [&](int hat) {
    result.hats.push_back(static_cast<float>(hat) / static_cast<float>(grid.samplesPerEdge() - 1));
    samples.emplace_back();
    return static_cast<uint32_t>(samples.size() - 1);
  };
  for (uint32_t r = 0; r < around.size(); ++r) {
    const auto& [triangle, corner] = around[r];
    const size_t second = (corner + 1u) % 3, third = (corner + 2u) % 3;
    for (uint32_t s = 0; s < grid.samples(); ++s) {
      const std::array<int, 3> steps = grid.steps(s);
      const int hat = steps[corner];
      if (hat == 0) continue;
      uint32_t row = 0;
      if (steps[second] > 0 && steps[third] > 0) {
        row = newRow(hat);
      } else {
        const bool isVertex = steps[second] == 0 && steps[third] == 0;
        const uint32_t other =
            isVertex ? vertex : rings.corners()[triangle][steps[second] > 0 ? second : third];
        const auto [at, isNew] = onEdges.try_emplace({other, hat}, 0u);
        if (isNew) at->second = newRow(hat);
        row = at->second;
      }
      result.rowOf[r * grid.samples() + s] = row;
      samples[row].push_back({r, s});
    }
  }
  result.first.push_back(0);
  for (const auto& ofRow : samples) {
    result.samples.insert(result.samples.end(), ofRow.begin(), ofRow.end());
    result.first.push_back(result.samples.size());
  }
  return result;
}

} // namespace surflect::lfm
