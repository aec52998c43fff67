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

// An observation as the matrix of a vertex needs it.
struct Sighting {
  uint32_t photograph = 0;
  DiscPoint point;
  Vec3<float> root;
  float fade = 1;
};
using Sightings = std::vector<Sighting>;

// Observations of a row by the triangles that share it; the first one's where several have one.
Sightings sightingsOf(const Patches& patches, const VertexFrame& frame, std::span<const RingTriangle> around,
                      std::span<const RingRows::Sample> samples) {
  Sightings sightings;
  for (const auto& [r, sample] : samples) {
    const auto before = static_cast<std::ptrdiff_t>(sightings.size());
    for (const Observation& o : patches.at(around[r].triangle).samples[sample])
      if (!std::ranges::binary_search(sightings.begin(), sightings.begin() + before, o.photograph, {},
                                      &Sighting::photograph))
        sightings.push_back({o.photograph, discPoint(frame, o.towards.cast<double>()),
                             o.radiance.unaryExpr([](float x) { return rootOf(x); }), o.fade});
    std::ranges::inplace_merge(sightings, sightings.begin() + before, {}, &Sighting::photograph);
  }
  return sightings;
}

// Photographs that see a row of the ring, and the places of their sites on the disc.
struct Sites {
  std::vector<uint32_t> photographs; // rising
  std::vector<DiscPoint> points;
};

// A site is the mean of the points at which rows have the photograph, by their fades and hat functions.
Sites sitesOf(std::span<const Sightings> rows, std::span<const float> hats) {
  std::map<uint32_t, std::pair<DiscPoint, double>> sums;
  for (size_t row = 0; row < rows.size(); ++row)
    for (const Sighting& s : rows[row]) {
      auto& [sum, weights] = sums.try_emplace(s.photograph, DiscPoint::Zero(), 0).first->second;
      const double weight = double{s.fade} * double{hats[row]};
      sum += weight * s.point;
      weights += weight;
    }
  Sites sites;
  for (const auto& [photograph, sum] : sums) {
    sites.photographs.push_back(photograph);
    sites.points.push_back(sum.first / sum.second);
  }
  return sites;
}

// Blends of a row's sightings at the sites. Rows that the same photographs see share a triangulation.
class RowBlends {
public:
  RowBlends(std::span<const DiscPoint> sites, double reach)
      : sites_(sites), reach_(reach), blends_(sites.size()) {}

  std::span<const CellBlend> of(const Sightings& sightings) {
    points_.clear(), photographs_.clear();
    for (const Sighting& s : sightings) points_.push_back(s.point), photographs_.push_back(s.photograph);
    const auto [shared, isNew] = meshes_.try_emplace(photographs_);
    auto& [mesh, places] = shared->second;
    if (isNew) places.assign(sites_.size(), 0);
    if (isNew || !mesh.holdsFor(points_)) mesh = siteMesh(points_);
    pointBlends(mesh, points_, sites_, reach_, places, blends_);
    return blends_;
  }

private:
  std::span<const DiscPoint> sites_;
  double reach_;
  std::vector<DiscPoint> points_;
  std::vector<uint32_t> photographs_;
  std::vector<CellBlend> blends_;
  std::map<std::vector<uint32_t>, std::pair<SiteMesh, std::vector<uint32_t>>> meshes_;
};

// Least fade of an observation in each of the blends whose mean is a row. A view that fades out along the
// surface leaves the blends one after another, so that rows change gradually.
constexpr std::array kFades{0.6f, 0.3f, 0.1f, 0.01f};

// Least fade of the clearest sightings: a given one, or that of the third clearest if it is less.
float fadeOfClearest(std::span<const float> fallingFades, float leastFade) {
  return std::min(leastFade, fallingFades[std::min<size_t>(2, fallingFades.size() - 1)]);
}

// Roots and weights of one row, without its hat function.
void resampleRow(const Sightings& sightings, RowBlends& blends, std::span<float> values,
                 std::span<float> weights) {
  std::vector<float> fades;
  for (const Sighting& s : sightings) fades.push_back(s.fade);
  std::ranges::sort(fades, std::greater<>());
  const auto countOf = [&](size_t i) {
    const float least = fadeOfClearest(fades, kFades[i]);
    return std::ranges::count_if(fades, [&](float fade) { return fade >= least; });
  };
  Sightings clearest;
  for (size_t first = 0, next = 0; first < kFades.size(); first = next) {
    next = first + 1;
    while (next < kFades.size() && countOf(next) == countOf(first)) ++next;
    const float share = static_cast<float>(next - first) / static_cast<float>(kFades.size());
    const float least = fadeOfClearest(fades, kFades[first]);
    clearest.clear();
    std::ranges::copy_if(sightings, std::back_inserter(clearest),
                         [&](const Sighting& s) { return s.fade >= least; });
    const std::span<const CellBlend> ofSites = blends.of(clearest);
    for (size_t site = 0; site < ofSites.size(); ++site) {
      const CellBlend& blend = ofSites[site];
      Vec3<float> sum = Vec3<float>::Zero();
      for (size_t k = 0; k < 3; ++k) sum += blend.weights[k] * clearest[blend.sites[k]].root;
      for (size_t c = 0; c < 3; ++c) values[3 * site + c] += share * sum[static_cast<Eigen::Index>(c)];
      if (blend.isObserved) weights[site] += share;
    }
  }
}

// Share of the grid that each site stands for.
std::vector<float> siteWeightsOf(std::span<const CellBlend> cells, size_t sites, const ViewGrid& grid) {
  std::vector<float> weights(sites, 0);
  for (size_t cell = 0; cell < cells.size(); ++cell)
    for (size_t k = 0; k < 3; ++k)
      weights[cells[cell].sites[k]] +=
          cells[cell].weights[k] * (cells[cell].isObserved && grid.isInDisc(cell) ? 1.f : kLeastWeight);
  const float largest = std::ranges::max(weights);
  for (float& weight : weights) weight /= largest;
  return weights;
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
  const size_t width = 3 * matrix.sites;
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

std::vector<float> inCells(std::span<const CellBlend> cells, std::span<const float> ofSites,
                           size_t channels) {
  std::vector<float> values(channels * cells.size(), 0);
  for (size_t cell = 0; cell < cells.size(); ++cell)
    for (size_t k = 0; k < 3; ++k)
      for (size_t c = 0; c < channels; ++c)
        values[channels * cell + c] += cells[cell].weights[k] * ofSites[channels * cells[cell].sites[k] + c];
  return values;
}

VertexMatrix matrixOf(const SeenLightField& field, const Patches& patches, uint32_t vertex,
                      const Progress& progress) {
  const std::span<const RingTriangle> around = field.rings.around(vertex);
  assert(!around.empty());
  const RingRows rows = ringRows(field.rings, vertex, field.patch);
  VertexMatrix matrix;
  matrix.rows = rows.rows();
  for (const auto& [triangle, corner] : around)
    if (corner == 0) matrix.triangleViews += patches.at(triangle).wholeViews.size();
  std::vector<Sightings> sightings;
  std::vector<uint8_t> isSeen;
  for (size_t row = 0; row < matrix.rows; ++row) {
    sightings.push_back(sightingsOf(patches, field.rings.frame(vertex), around, rows.of(row)));
    isSeen.push_back(!sightings.back().empty());
  }
  matrix.unseenRows = static_cast<size_t>(std::ranges::count(isSeen, 0));
  if (matrix.unseenRows == matrix.rows) return matrix;

  const Sites sites = sitesOf(sightings, rows.hats);
  matrix.sites = sites.points.size();
  matrix.cells = cellBlends(siteMesh(sites.points), sites.points, field.views);
  matrix.siteWeights = siteWeightsOf(matrix.cells, matrix.sites, field.views);
  matrix.values.assign(3 * matrix.rows * matrix.sites, 0);
  matrix.weights.assign(matrix.rows * matrix.sites, 0);
  RowBlends blends(sites.points, 1.0 / field.views.size());
  for (size_t row = 0; row < matrix.rows; ++row) {
    progress.checkpoint();
    if (isSeen[row])
      resampleRow(sightings[row], blends,
                  std::span(matrix.values).subspan(3 * row * matrix.sites, 3 * matrix.sites),
                  std::span(matrix.weights).subspan(row * matrix.sites, matrix.sites));
  }
  if (matrix.unseenRows > 0) fillUnseen(matrix, isSeen, neighborsOf(rows, field.patch));
  for (size_t row = 0; row < matrix.rows; ++row)
    for (float& value : std::span(matrix.values).subspan(3 * row * matrix.sites, 3 * matrix.sites))
      value *= rows.hats[row];
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
               cells = count(ViewGrid(sizes.viewSize).cells()),
               columns = sizes.columns > 0 ? count(sizes.columns) : cells;
  const double vertices = count(rings.vertices().size()), triangles = count(rings.corners().size());
  const double channels = count(sizes.channels), terms = count(sizes.terms);
  const double matrix = (channels + 1) * count(mostRows(rings, sizes.samples)) * columns; // and its weights
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
    for (size_t site = 0; site < matrix.sites; ++site) {
      const double weight =
          double{matrix.weights[row * matrix.sites + site]} * double{matrix.siteWeights[site]};
      if (weight == 0) continue;
      for (size_t c = 0; c < 3; ++c)
        sum[static_cast<Eigen::Index>(c)] += weight * static_cast<double>(matrix.value(row, site, c));
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
  VertexMatrix matrix{.rows = rows.rows(), .sites = 1, .unseenRows = rows.rows()};
  matrix.cells.assign(cells, {{0, 0, 0}, {1, 0, 0}, false});
  matrix.siteWeights = {1};
  matrix.weights.assign(rows.rows(), 0);
  for (size_t row = 0; row < rows.rows(); ++row)
    for (const float channel : root) matrix.values.push_back(rows.hats[row] * channel);
  return matrix;
}

} // namespace surflect::lfm
