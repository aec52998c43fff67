#include "render/lightfield/lfm/vertex_matrix.h"

#include "render/lightfield/lfm/direction_disc.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/view_blend.h"
#include "surfel/base/error.h"
#include "surfel/base/memory.h"

#include <fmt/format.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <functional>
#include <iterator>
#include <map>
#include <span>
#include <utility>

namespace surflect::lfm {

namespace {

using Observations = std::vector<Observation>;
using Photographs = std::vector<uint32_t>;

Photographs photographsOf(const Observations& observations) {
  Photographs photographs;
  for (const Observation& observation : observations) photographs.push_back(observation.photograph);
  return photographs;
}

// Observations by either of two triangles that share a point; the first one's where both have one.
Observations merged(const Observations& first, const Observations& second) {
  Observations both;
  std::ranges::set_union(first, second, std::back_inserter(both), {}, &Observation::photograph,
                         &Observation::photograph);
  return both;
}

// Blends for the rows of a vertex. Rows that the same photographs see share a triangulation.
class RowBlends {
public:
  RowBlends(const VertexFrame& frame, const ViewGrid& grid) : frame_(frame), grid_(grid) {}

  std::vector<CellBlend> of(const Observations& observations) {
    std::vector<DiscPoint> sites;
    for (const Observation& o : observations) sites.push_back(discPoint(frame_, o.towards.cast<double>()));
    const auto [shared, isNew] = meshes_.try_emplace(photographsOf(observations));
    if (isNew) shared->second = siteMesh(sites);
    return shared->second.holdsFor(sites) ? cellBlends(shared->second, sites, grid_)
                                          : cellBlends(siteMesh(sites), sites, grid_);
  }

private:
  const VertexFrame& frame_;
  const ViewGrid& grid_;
  std::map<Photographs, SiteMesh> meshes_;
};

// Least fade of an observation in each of the blends whose mean is a row. A view that fades out along the
// surface leaves the blends one after another, so that rows change gradually.
constexpr std::array kFades{0.6f, 0.3f, 0.1f, 0.01f};

// The clearest observations: those of at least a fade, or the three clearest if these are more.
Observations clearestOf(const Observations& observations, float leastFade) {
  std::vector<float> fades;
  for (const Observation& o : observations) fades.push_back(o.fade);
  std::ranges::sort(fades, std::greater<>());
  const float third = fades[std::min<size_t>(2, fades.size() - 1)];
  Observations clearest;
  for (const Observation& o : observations)
    if (o.fade >= std::min(leastFade, third)) clearest.push_back(o);
  return clearest;
}

// Adds one blend to a row without its hat function.
void addBlend(const Observations& observations, std::span<const CellBlend> blends,
              std::span<const uint8_t> isInDisc, float share, std::span<float> values,
              std::span<float> weights) {
  for (size_t cell = 0; cell < blends.size(); ++cell) {
    const CellBlend& blend = blends[cell];
    Vec3<float> sum = Vec3<float>::Zero();
    for (size_t k = 0; k < 3; ++k) sum += blend.weights[k] * observations[blend.sites[k]].radiance;
    for (size_t c = 0; c < 3; ++c) values[3 * cell + c] += share * sum[static_cast<Eigen::Index>(c)];
    if (blend.isObserved && isInDisc[cell]) weights[cell] += share;
  }
}

// Radiance and weights of one row, without its hat function.
void resampleRow(const Observations& observations, RowBlends& blends, std::span<const uint8_t> isInDisc,
                 std::span<float> values, std::span<float> weights) {
  for (size_t first = 0, next = 0; first < kFades.size(); first = next) {
    const Observations clearest = clearestOf(observations, kFades[first]);
    next = first + 1;
    while (next < kFades.size() && clearestOf(observations, kFades[next]).size() == clearest.size()) ++next;
    addBlend(clearest, blends.of(clearest), isInDisc,
             static_cast<float>(next - first) / static_cast<float>(kFades.size()), values, weights);
  }
}

// Rows of the samples beside each row's, with repetitions.
std::vector<std::vector<uint32_t>> neighborsOf(const RingRows& rows, const PatchGrid& grid) {
  constexpr std::array<PatchPlace, 3> kSteps{{{1, 0}, {0, 1}, {-1, 1}}};
  std::vector<std::vector<uint32_t>> neighbors(rows.rows());
  for (size_t first = 0; first < rows.rowOf.size(); first += grid.samples())
    for (size_t sample = 0; sample < grid.samples(); ++sample) {
      const uint32_t row = rows.rowOf[first + sample];
      const PatchPlace place = grid.place(sample);
      for (const PatchPlace& step : kSteps) {
        const PatchPlace beside{place.i + step.i, place.j + step.j};
        if (row == RingRows::kNone || beside.i < 0 || beside.i + beside.j >= grid.samplesPerEdge()) continue;
        const uint32_t other = rows.rowOf[first + grid.index(beside)];
        if (other == RingRows::kNone) continue;
        neighbors[row].push_back(other);
        neighbors[other].push_back(row);
      }
    }
  return neighbors;
}

// Fills unseen rows from the seen ones outwards: each is the mean of the rows beside it that were filled in
// earlier rounds.
void fillUnseen(VertexMatrix& matrix, std::vector<uint8_t> isSeen,
                const std::vector<std::vector<uint32_t>>& neighbors) {
  const size_t width = 3 * matrix.cells;
  std::vector<uint32_t> left;
  for (uint32_t row = 0; row < matrix.rows; ++row)
    if (!isSeen[row]) left.push_back(row);
  for (size_t before = left.size() + 1; left.size() < before;) {
    before = left.size();
    std::vector<uint32_t> filled;
    for (const uint32_t row : left) {
      float count = 0;
      const auto own = std::span(matrix.values).subspan(row * width, width);
      for (const uint32_t other : neighbors[row]) {
        if (!isSeen[other]) continue;
        ++count;
        for (size_t i = 0; i < width; ++i) own[i] += matrix.values[other * width + i];
      }
      if (count == 0) continue;
      for (float& value : own) value /= count;
      filled.push_back(row);
    }
    for (const uint32_t row : filled) isSeen[row] = 1;
    std::erase_if(left, [&](uint32_t row) { return isSeen[row]; });
  }
}

} // namespace

VertexMatrix matrixOf(const SeenLightField& field, const Patches& patches, uint32_t vertex,
                      const Progress& progress) {
  const std::span<const RingTriangle> around = field.rings.around(vertex);
  assert(!around.empty());
  const RingRows rows = ringRows(field.rings, vertex, field.patch);
  VertexMatrix matrix{rows.rows(), field.views.cells(), {}, {}, 0, 0};
  matrix.values.assign(3 * matrix.rows * matrix.cells, 0);
  matrix.weights.assign(matrix.rows * matrix.cells, 0);

  for (const auto& [triangle, corner] : around)
    if (corner == 0) matrix.triangleViews += patches.at(triangle).wholeViews.size();
  std::vector<uint8_t> isInDisc(matrix.cells), isSeen(matrix.rows);
  for (size_t cell = 0; cell < matrix.cells; ++cell) isInDisc[cell] = field.views.isInDisc(cell);
  RowBlends blends(field.rings.frame(vertex), field.views);
  for (size_t row = 0; row < matrix.rows; ++row) {
    progress.checkpoint();
    Observations observations;
    for (const auto& [r, sample] : rows.of(row))
      observations = merged(observations, patches.at(around[r].triangle).samples[sample]);
    isSeen[row] = !observations.empty();
    if (!isSeen[row]) continue;
    resampleRow(observations, blends, isInDisc,
                std::span(matrix.values).subspan(3 * row * matrix.cells, 3 * matrix.cells),
                std::span(matrix.weights).subspan(row * matrix.cells, matrix.cells));
  }
  matrix.unseenRows = static_cast<size_t>(std::ranges::count(isSeen, 0));
  if (matrix.unseenRows > 0) fillUnseen(matrix, isSeen, neighborsOf(rows, field.patch));
  for (size_t row = 0; row < matrix.rows; ++row)
    for (float& value : std::span(matrix.values).subspan(3 * row * matrix.cells, 3 * matrix.cells))
      value = rows.hats[row] * rootOf(value);
  return matrix;
}

VertexMatrix matrixOf(const SeenLightField& field, uint32_t vertex) {
  Patches patches(field);
  patches.observe({&vertex, 1});
  return matrixOf(field, patches, vertex);
}

namespace {

// Rows of the largest matrix. The hat function is 0 on the edge beyond the vertex.
size_t mostRows(const Rings& rings, int samples) {
  size_t ring = 0;
  for (const uint32_t vertex : rings.vertices()) ring = std::max(ring, rings.around(vertex).size());
  return ring * (PatchGrid::samples(samples) - static_cast<size_t>(samples));
}

} // namespace

size_t mostTerms(const Rings& rings, const MapSizes& sizes) {
  return std::min(mostRows(rings, sizes.samples), sizes.channels * ViewGrid(sizes.viewSize).cells());
}

double memoryFor(const Rings& rings, const MapSizes& sizes) {
  const auto count = [](size_t number) { return static_cast<double>(number); };
  const double samples = count(PatchGrid::samples(sizes.samples)),
               cells = count(ViewGrid(sizes.viewSize).cells());
  const double vertices = count(rings.vertices().size()), triangles = count(rings.corners().size());
  const double channels = count(sizes.channels), terms = count(sizes.terms);
  const double matrix = (channels + 1) * count(mostRows(rings, sizes.samples)) * cells; // and its weights
  const double threads = tbb::this_task_arena::max_concurrency();
  const double matrices = 2 * sizeof(float) * matrix * threads; // observed and arranged
  const double maps = terms * (3 * triangles * samples + channels * vertices * cells) +
                      3 * sizeof(float) * channels * triangles * samples;
  return matrices + maps;
}

void requireMemoryFor(const Rings& rings, const MapSizes& sizes) {
  atField(fmt::format("samples {} and view_size {}", sizes.samples, sizes.viewSize), [&] {
    requireMemory(memoryFor(rings, sizes),
                  fmt::format("matrices and maps of {} triangles", rings.corners().size()));
  });
}

uint64_t resampledBytes(size_t triangles, size_t samples, size_t cells, size_t channels) {
  return uint64_t{channels} * uint64_t{triangles} * samples * cells;
}

uint64_t normalizedBytes(size_t triangleViews, size_t samples) {
  return 3 * uint64_t{triangleViews} * samples;
}

Vec3<float> meanRoot(const VertexMatrix& matrix, const RingRows& rows) {
  assert(rows.rows() == matrix.rows);
  Vec3<double> sum = Vec3<double>::Zero();
  double weights = 0;
  for (size_t row = 0; row < matrix.rows; ++row)
    for (size_t cell = 0; cell < matrix.cells; ++cell) {
      const auto weight = static_cast<double>(matrix.weights[row * matrix.cells + cell]);
      if (weight == 0) continue;
      for (size_t c = 0; c < 3; ++c)
        sum[static_cast<Eigen::Index>(c)] += weight * static_cast<double>(matrix.value(row, cell, c));
      weights += weight * static_cast<double>(rows.hats[row]);
    }
  return weights > 0 ? Vec3<float>((sum / weights).cast<float>()) : Vec3<float>::Zero();
}

void spreadToUnseen(const Rings& rings, std::span<const uint8_t> isSeen, std::span<Vec3<float>> roots) {
  assert(isSeen.size() == roots.size());
  std::vector<uint8_t> isKnown(isSeen.begin(), isSeen.end());
  std::vector<std::pair<uint32_t, Vec3<float>>> found;
  do {
    found.clear();
    for (const uint32_t v : rings.vertices()) {
      if (isKnown[v]) continue;
      Vec3<float> sum = Vec3<float>::Zero();
      float count = 0;
      for (const auto& [triangle, corner] : rings.around(v))
        for (const uint32_t other : rings.corners()[triangle])
          if (isKnown[other]) sum += roots[other], ++count;
      if (count > 0) found.emplace_back(v, sum / count);
    }
    for (const auto& [v, mean] : found) isKnown[v] = 1, roots[v] = mean;
  } while (!found.empty());
}

VertexMatrix constantMatrix(const RingRows& rows, size_t cells, const Vec3<float>& root) {
  VertexMatrix matrix{rows.rows(), cells, {}, {}, rows.rows(), 0};
  matrix.weights.assign(rows.rows() * cells, 0);
  matrix.values.resize(3 * rows.rows() * cells);
  for (size_t row = 0; row < rows.rows(); ++row)
    for (size_t cell = 0; cell < cells; ++cell)
      for (size_t c = 0; c < 3; ++c)
        matrix.value(row, cell, c) = rows.hats[row] * root[static_cast<Eigen::Index>(c)];
  return matrix;
}

} // namespace surflect::lfm
