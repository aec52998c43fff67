#include "render/lightfield/lfm/edge_corrections.h"

#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/tile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <utility>

namespace surflect::lfm {

namespace {

// Numbers of edges, each counted once from either end.
class DirectedEdges {
public:
  explicit DirectedEdges(const TriangleMesh& mesh) : mesh_(mesh) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> numbers;
    for (const auto& triangle : mesh.triangles)
      for (size_t corner = 0; corner < 3; ++corner)
        for (size_t side = 0; side < 2; ++side) {
          const std::pair ends{triangle[corner], triangle[(corner + 1 + side) % 3]};
          of_.push_back(numbers.try_emplace(ends, static_cast<uint32_t>(numbers.size())).first->second);
        }
    count_ = numbers.size();
  }

  size_t count() const { return count_; }
  // Number of the edge from a corner of a triangle along one of its two sides.
  size_t of(size_t triangle, size_t corner, size_t side) const {
    return of_[6 * triangle + 2 * corner + side];
  }
  const TriangleMesh& mesh() const { return mesh_; }

private:
  const TriangleMesh& mesh_;
  std::vector<uint32_t> of_; // [triangles][corners][sides]
  size_t count_ = 0;
};

// A sample on a side of a corner.
struct EdgePlace {
  size_t triangle = 0, corner = 0, side = 0, step = 0;
};

PatchPlace patchPlace(int samplesPerEdge, const EdgePlace& at) {
  std::array<int, 3> steps{0, 0, 0};
  steps[at.corner] = samplesPerEdge - 1 - static_cast<int>(at.step);
  steps[(at.corner + 1 + at.side) % 3] = static_cast<int>(at.step);
  return {steps[1], steps[2]};
}

void forPlaces(size_t triangles, size_t samples, const auto& work) {
  for (size_t triangle = 0; triangle < triangles; ++triangle)
    for (size_t corner = 0; corner < 3; ++corner)
      for (size_t side = 0; side < 2; ++side)
        for (size_t step = 0; step < samples; ++step) work(EdgePlace{triangle, corner, side, step});
}

constexpr int kMostSteps = 127;

// Codes of the triangles at a sample.
struct CodesAtSample {
  int sum = 0, count = 0, least = 255, greatest = -255;

  void add(int code) {
    sum += code, ++count;
    least = std::min(least, code), greatest = std::max(greatest, code);
  }
  // Their mean, or the nearest code that is at most 127 steps away from each.
  int common() const {
    const auto mean = static_cast<int>(std::lround(static_cast<double>(sum) / count));
    return std::max(std::min(mean, least + kMostSteps), greatest - kMostSteps);
  }
};

// Whose values are on an edge: of its first vertex, or of the surface, for which both ends are vertices
// alike.
enum class ValuesOf { vertex, surface };

// Calls store(place, correction) for all samples on edges; codeAt(place) is the code of a byte.
void forCorrections(const DirectedEdges& edges, size_t samples, ValuesOf kind, const auto& codeAt,
                    const auto& store) {
  const TriangleMesh& mesh = edges.mesh();
  std::vector<CodesAtSample> onEdges(edges.count() * samples), atVertices(mesh.positions.size());
  const auto codesAt = [&](const EdgePlace& at) -> CodesAtSample& {
    const auto& corners = mesh.triangles[at.triangle];
    if (at.step == 0) return atVertices[corners[at.corner]];
    if (at.step == samples - 1 && kind == ValuesOf::surface)
      return atVertices[corners[(at.corner + 1 + at.side) % 3]];
    return onEdges[edges.of(at.triangle, at.corner, at.side) * samples + at.step];
  };
  forPlaces(mesh.triangles.size(), samples, [&](const EdgePlace& at) { codesAt(at).add(codeAt(at)); });
  forPlaces(mesh.triangles.size(), samples, [&](const EdgePlace& at) {
    store(at, static_cast<int8_t>(std::clamp(codesAt(at).common() - codeAt(at), -kMostSteps, kMostSteps)));
  });
}

int codeOf(bool isSigned, uint8_t byte) {
  return isSigned ? std::max(int{static_cast<int8_t>(byte)}, -127) : int{byte};
}

void clearZeros(std::vector<int8_t>& numbers) {
  if (std::ranges::all_of(numbers, [](int8_t number) { return number == 0; })) numbers = {};
}

MapSet inBytes(const MapSet& maps, const MapShape& shape, bool isSigned) {
  return maps.coding == Coding::bytes ? maps : decoded(shape, maps, isSigned);
}

constexpr size_t kMeanChannels = 4;

// Value at a distance 0..1 along a row of `samples` numbers, which are `stride` apart.
double rowAt(const int8_t* row, size_t samples, size_t stride, double distance) {
  const double place = std::clamp(distance, 0.0, 1.0) * static_cast<double>(samples - 1);
  const size_t low = std::min(static_cast<size_t>(place), samples - 2);
  const double share = place - static_cast<double>(low);
  return (1 - share) * row[low * stride] + share * row[(low + 1) * stride];
}

} // namespace

EdgeCorrections edgeCorrections(const LightFieldMaps& maps) {
  const size_t triangles = maps.mesh.triangles.size(), terms = maps.terms.size();
  const auto n = static_cast<size_t>(maps.samples);
  const bool isSigned = maps.method == Factorization::pca, isPacked = maps.layout == SurfaceLayout::packed;
  EdgeCorrections result{n, terms, {}, {}, 1 / (isSigned ? 127.0 : 255.0), 1 / 255.0};
  const DirectedEdges edges(maps.mesh);
  const PatchGrid grid(maps.samples);

  const MapShape surface = surfaceShape(maps);
  result.surface.resize(triangles * terms * 3 * n * 2);
  for (size_t k = 0; k < terms; ++k) {
    const MapSet set = inBytes(maps.terms[k].surface.maps, surface, isSigned);
    const std::vector<uint32_t>& mapOf = maps.terms[k].surface.mapOf;
    const auto codeAt = [&](const EdgePlace& at) {
      const uint32_t map = mapOf[isPacked ? at.triangle : 3 * at.triangle + at.corner];
      if (map == kNoMap) return 0;
      const PatchPlace place = patchPlace(maps.samples, at);
      const size_t sample =
          isPacked ? 3 * grid.index(place) + at.corner : grid.index(turned(maps.samples, place, at.corner));
      return codeOf(isSigned, set.data[map * surface.bytes() + sample]);
    };
    forCorrections(edges, n, ValuesOf::vertex, codeAt, [&](const EdgePlace& at, int8_t correction) {
      result.surface[(((at.triangle * terms + k) * 3 + at.corner) * n + at.step) * 2 + at.side] = correction;
    });
  }
  clearZeros(result.surface);

  if (maps.mean.mapOf.empty()) return result;
  const MapShape mean = meanShape(maps);
  const MapSet set = inBytes(maps.mean.maps, mean, false);
  result.mean.resize(triangles * 3 * n * kMeanChannels);
  for (size_t c = 0; c < maps.channels; ++c) {
    const auto codeAt = [&](const EdgePlace& at) {
      const uint32_t map = maps.mean.mapOf[at.triangle];
      if (map == kNoMap) return 0;
      const size_t sample = grid.index(patchPlace(maps.samples, at));
      return int{set.data[map * mean.bytes() + maps.channels * sample + c]};
    };
    forCorrections(edges, n, ValuesOf::surface, codeAt, [&](const EdgePlace& at, int8_t correction) {
      if (at.side == 0)
        result.mean[((at.triangle * 3 + at.corner) * n + at.step) * kMeanChannels + c] = correction;
    });
  }
  clearZeros(result.mean);
  return result;
}

double surfaceCorrection(const EdgeCorrections& edges, size_t triangle, size_t term, size_t corner,
                         const Vec3<double>& b) {
  if (edges.surface.empty()) return 0;
  const int8_t* const rows =
      &edges.surface[((triangle * edges.terms + term) * 3 + corner) * edges.samples * 2];
  const double distance = 1 - b[static_cast<Eigen::Index>(corner)];
  return edges.surfaceUnit * fromSides(b, corner, rowAt(rows, edges.samples, 2, distance),
                                       rowAt(rows + 1, edges.samples, 2, distance), edges.samples);
}

double meanCorrection(const EdgeCorrections& edges, size_t triangle, size_t channel, const Vec3<double>& b) {
  if (edges.mean.empty()) return 0;
  const auto valueOn = [&](size_t corner, double share) {
    const int8_t* const row = &edges.mean[(triangle * 3 + corner) * edges.samples * kMeanChannels + channel];
    return rowAt(row, edges.samples, kMeanChannels, share);
  };
  return edges.meanUnit * fromEdges(b, valueOn, edges.samples);
}

} // namespace surflect::lfm
