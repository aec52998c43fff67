#include "render/lightfield/lfm/build.h"

#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/sight.h"
#include "render/lightfield/lfm/factorization.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/observe.h"
#include "render/lightfield/lfm/patch_grid.h"
#include "render/lightfield/lfm/patches.h"
#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/unseen_vertices.h"
#include "render/lightfield/lfm/view_grid.h"
#include "surfel/base/error.h"
#include "surfel/base/stopwatch.h"
#include "surfel/geometry/smooth_normals.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

// Mean root of radiance that each corner of a triangle adds to its samples:
// [triangle][sample][corner][channel].
class MeanShares {
public:
  MeanShares(size_t triangles, size_t samples) : samples_(samples), values_(9 * triangles * samples, 0.f) {}

  std::span<float> at(size_t triangle, size_t sample, size_t corner) {
    return std::span(values_).subspan(3 * (3 * (triangle * samples_ + sample) + corner), 3);
  }
  // Sum over the corners, of one channel.
  float sum(size_t triangle, size_t sample, size_t channel) const {
    const float* share = &values_[9 * (triangle * samples_ + sample) + channel];
    return share[0] + share[3] + share[6]; // on an edge one is 0, so that the order does not matter
  }
  float largest() const {
    float largest = 0;
    for (size_t i = 0; i < values_.size(); i += 9)
      for (size_t channel = 0; channel < 3; ++channel)
        largest =
            std::max(largest, values_[i + channel] + values_[i + 3 + channel] + values_[i + 6 + channel]);
    return largest;
  }

private:
  size_t samples_;
  std::vector<float> values_;
};

std::vector<uint8_t> bytesOfMap(std::span<const float> map, float scale, Method method) {
  if (method == Method::nmf) return unorm8Of(map, scale);
  const std::vector<int8_t> codes = snorm8Of(map, scale);
  return {codes.begin(), codes.end()};
}

// Writes the factors of a vertex into the maps.
void store(const Factors& factors, const Rings& rings, const RingRows& rows, uint32_t vertex,
           LightFieldMaps& maps, MeanShares& means) {
  const size_t samples = PatchGrid::samples(maps.samples);
  const std::span<const RingTriangle> ring = rings.around(vertex);
  const PatchGrid grid(maps.samples);
  for (size_t k = 0; k < factors.terms.size(); ++k) {
    const FactorTerm& factor = factors.terms[k];
    Term& term = maps.terms[k];
    std::vector<float> withoutHat(factor.surface);
    for (size_t row = 0; row < rows.rows(); ++row) withoutHat[row] /= rows.hats[row];
    const float surfaceScale = scaleOf(withoutHat), viewScale = scaleOf(factor.view);
    term.scale[vertex] = surfaceScale * viewScale;
    const std::vector<uint8_t> surface = bytesOfMap(withoutHat, surfaceScale, maps.method),
                               view = bytesOfMap(factor.view, viewScale, maps.method);
    std::ranges::copy(view, term.view.maps.data.begin() + static_cast<std::ptrdiff_t>(vertex * view.size()));
    for (size_t r = 0; r < ring.size(); ++r)
      for (size_t sample = 0; sample < samples; ++sample) {
        uint32_t row = rows.rowOf[r * samples + sample];
        if (row == RingRows::kNone)
          row = rows.rowOf[r * samples + grid.besideFarEdge(sample, ring[r].corner)];
        term.surface.maps.data[3 * (ring[r].triangle * samples + sample) + ring[r].corner] = surface[row];
      }
  }
  for (size_t r = 0; r < ring.size() && !factors.mean.empty(); ++r)
    for (size_t sample = 0; sample < samples; ++sample)
      if (const uint32_t row = rows.rowOf[r * samples + sample]; row != RingRows::kNone)
        std::copy_n(&factors.mean[3 * row], 3, means.at(ring[r].triangle, sample, ring[r].corner).begin());
}

// Vertices whose triangles are observed together; neighbours in the list share most of them.
constexpr size_t kVerticesAtOnce = 64;

// Weight of extrapolated values, which hold factors where few samples were observed. Without it, extrapolated
// directions show as black or bright blots.
constexpr float kLeastWeight = 0.02f;

// Means above this many times the root of white are cut off, so that few bright samples do not take all
// codes.
constexpr double kBrightestMean = 2;

void storeMeans(const MeanShares& means, double white, LightFieldMaps& maps) {
  const size_t samples = PatchGrid::samples(maps.samples);
  if (const float largest = means.largest(); largest > 0)
    maps.meanWhite = std::min(largest, static_cast<float>(kBrightestMean * rootOf(white)));
  tbb::parallel_for(size_t{0}, maps.mesh.triangles.size(), [&](size_t triangle) {
    for (size_t sample = 0; sample < samples; ++sample)
      for (size_t channel = 0; channel < 3; ++channel)
        maps.mean.maps.data[3 * (triangle * samples + sample) + channel] =
            meanByte(means.sum(triangle, sample, channel), maps.meanWhite);
  });
}

} // namespace

std::vector<double> relativeErrors(const BuildReport& report) {
  std::vector<double> relative;
  for (const FactorError& error : report.errors) relative.push_back(error.rms() / rootOf(report.white));
  return relative;
}

LightFieldMaps build(const lightfield::Views& views, const BuildOptions& options, BuildReport& report,
                     const Progress& progress) {
  if (options.terms > kMostTerms)
    throw Error::mismatch("0.." + std::to_string(kMostTerms), std::to_string(options.terms)).at("terms");
  if (options.terms == 0 && options.method == Method::nmf)
    throw Error("found 0, expected at least 1 for nmf, which has no mean").at("terms");
  const PatchGrid patch(options.samples);
  const ViewGrid grid(options.viewSize);
  report = {};
  Stopwatch stopwatch;
  const Rings rings(views.mesh(), progress);
  TriangleMesh mesh = views.mesh();
  mesh.triangles.assign(rings.corners().begin(), rings.corners().end());
  std::vector<VertexFrame> frames;
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) frames.push_back(rings.frame(v));
  LightFieldMaps maps = emptyMaps(std::move(mesh), std::move(frames), options.method, options.samples,
                                  options.viewSize, options.terms);
  const lightfield::Photographs photographs(views, progress);
  const lightfield::Sight sight(photographs, views.rays());
  const SmoothNormals normals(views.mesh(), progress);
  report.seconds["photographs"] = stopwatch.seconds();
  report.photographs = photographs.size(), report.white = photographs.whiteLevel();

  const SeenLightField field{views.mesh(),   rings, patch, grid, observeIn(sight, views.mesh(), normals),
                             options.visible};
  const FactorizationOptions factorization{.method = options.method,
                                           .terms = options.terms,
                                           .tolerance = options.tolerance * rootOf(report.white),
                                           .leastWeight = kLeastWeight};
  MeanShares means(options.method == Method::pca ? maps.mesh.triangles.size() : 0, patch.samples());
  struct Result {
    std::vector<FactorError> errors; // after 0, 1, ... terms
    size_t terms = 0;
    size_t rows = 0, unseenRows = 0, triangleViews = 0;
    double matrixSeconds = 0, factorSeconds = 0;
  };
  const std::span<const uint32_t> vertices = rings.vertices();
  std::vector<Result> results(vertices.size());
  std::vector<Vec3<float>> roots(maps.mesh.positions.size(), Vec3<float>::Zero());
  std::vector<uint8_t> isSeen(maps.mesh.positions.size(), 0);
  const auto factorise = [&](size_t i, const VertexMatrix& matrix, const RingRows& rows) {
    const Stopwatch watch;
    const LightFieldMatrix observed{matrix.rows, matrix.cells, matrix.values, matrix.weights};
    const Factors factors = factorized(observed, factorization, {{}, progress.cancelled});
    store(factors, rings, rows, vertices[i], maps, means);
    Result& result = results[i];
    result.terms = factors.terms.size();
    for (size_t k = 0; k <= options.terms; ++k)
      result.errors.push_back(k <= result.terms ? errorOf(factors, k, observed) : result.errors.back());
    result.factorSeconds = watch.seconds();
  };
  std::mutex reporting;
  size_t done = 0;
  Patches patches(field);
  for (size_t first = 0; first < vertices.size(); first += kVerticesAtOnce) {
    const auto batch = vertices.subspan(first, std::min(kVerticesAtOnce, vertices.size() - first));
    stopwatch = {};
    patches.observe(batch, progress);
    report.seconds["patches"] += stopwatch.seconds();
    tbb::parallel_for(first, first + batch.size(), [&](size_t i) {
      progress.checkpoint();
      const Stopwatch watch;
      const VertexMatrix matrix = matrixOf(field, patches, vertices[i], {{}, progress.cancelled});
      const RingRows rows = ringRows(rings, vertices[i], patch);
      Result& result = results[i];
      result.matrixSeconds = watch.seconds();
      result.rows = matrix.rows, result.unseenRows = matrix.unseenRows;
      result.triangleViews = matrix.triangleViews;
      if (matrix.unseenRows < matrix.rows) {
        isSeen[vertices[i]] = 1;
        roots[vertices[i]] = meanRoot(matrix, rows);
        factorise(i, matrix, rows);
      }
      const std::scoped_lock lock(reporting);
      progress("factorise", static_cast<double>(++done) / static_cast<double>(vertices.size()));
    });
    patches.release(batch);
  }
  spreadToUnseen(rings, isSeen, roots);
  tbb::parallel_for(size_t{0}, vertices.size(), [&](size_t i) {
    progress.checkpoint();
    if (isSeen[vertices[i]]) return;
    const RingRows rows = ringRows(rings, vertices[i], patch);
    factorise(i, constantMatrix(rows, grid.cells(), roots[vertices[i]]), rows);
  });
  report.vertices = vertices.size();
  size_t triangleViews = 0;
  for (const Result& result : results) {
    report.errors.resize(options.terms + 1);
    for (size_t k = 0; k < result.errors.size(); ++k) {
      report.errors[k].squares += result.errors[k].squares;
      report.errors[k].weight += result.errors[k].weight;
    }
    report.meanTerms += static_cast<double>(result.terms) / static_cast<double>(vertices.size());
    report.unseenVertices += result.rows == result.unseenRows;
    report.rows += result.rows, report.unseenRows += result.unseenRows;
    triangleViews += result.triangleViews;
    report.seconds["matrices"] += result.matrixSeconds, report.seconds["factors"] += result.factorSeconds;
  }
  report.resampledBytes = resampledBytes(maps.mesh.triangles.size(), patch.samples(), grid.cells());
  report.normalizedBytes = normalizedBytes(triangleViews, patch.samples());
  if (options.method == Method::pca) storeMeans(means, report.white, maps);
  return withoutZeros(std::move(maps));
}

} // namespace surflect::lfm
