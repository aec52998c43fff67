#include "render/lightfield/lfm/build.h"

#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/sight.h"
#include "render/lightfield/lfm/factorization.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/patches.h"
#include "render/lightfield/lfm/rings.h"
#include "render/lightfield/lfm/root_radiance.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "render/lightfield/lfm/view_blend.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"
#include "surfel/geometry/smooth_normals.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace surflect::lfm {

namespace {

// Vertices whose triangles are observed together; neighbours in the list share most of them.
constexpr size_t kVerticesAtOnce = 64;

} // namespace

std::vector<double> relativeErrors(const BuildReport& report) {
  std::vector<double> relative;
  for (const FactorError& error : report.errors) relative.push_back(error.rms() / rootOf(report.white));
  return relative;
}

MapSizes sizesOf(const lightfield::Views& views, const BuildOptions& options) {
  return {.samples = options.samples,
          .viewSize = options.viewSize,
          .terms = options.terms,
          .columns = views.ofSplit(capture::Split::train).size()};
}

LightFieldMaps build(const lightfield::Views& views, const BuildOptions& options, BuildReport& report,
                     const Progress& progress) {
  if (options.terms > kMostTerms)
    throw Error::mismatch("0.." + std::to_string(kMostTerms), std::to_string(options.terms)).at("terms");
  if (options.terms == 0 && options.method == Factorization::nmf)
    throw Error("found 0, expected at least 1 for nmf, which has no mean").at("terms");
  const PatchGrid patch(options.samples);
  const ViewGrid grid(options.viewSize);
  report = {};
  Stopwatch stopwatch;
  const Rings rings(views.mesh(), progress);
  const MapSizes sizes = sizesOf(views, options);
  if (const size_t most = mostTerms(rings, sizes);
      options.method == Factorization::nmf && options.terms > most)
    throw Error::mismatch(
        fmt::format("at most {}, the samples around a vertex or, if fewer, its directions times channels",
                    most),
        std::to_string(options.terms))
        .at("terms");
  requireMemoryFor(rings, sizes);
  TriangleMesh mesh = views.mesh();
  mesh.triangles.assign(rings.corners().begin(), rings.corners().end());
  std::vector<VertexFrame> frames;
  for (uint32_t v = 0; v < mesh.positions.size(); ++v) frames.push_back(rings.frame(v));
  MapStore store(emptyMaps(std::move(mesh), std::move(frames), options.method, options.samples,
                           options.viewSize, options.terms),
                 rings);
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
  struct Result {
    std::vector<FactorError> errors; // after 0, 1, ... terms
    size_t terms = 0;
    size_t rows = 0, unseenRows = 0, triangleViews = 0;
    double matrixSeconds = 0, factorSeconds = 0;
  };
  const std::span<const uint32_t> vertices = rings.vertices();
  std::vector<Result> results(vertices.size());
  std::vector<Vec3<float>> roots(views.mesh().positions.size(), Vec3<float>::Zero());
  std::vector<uint8_t> isSeen(views.mesh().positions.size(), 0);
  const auto factorise = [&](size_t i, const VertexMatrix& matrix, const RingRows& rows) {
    const Stopwatch watch;
    const LightFieldMatrix observed{matrix.rows, matrix.sites,      matrix.values, matrix.weights,
                                    3,           matrix.siteWeights};
    Factors factors = factorized(observed, factorization, {{}, progress.cancelled});
    Result& result = results[i];
    result.terms = factors.terms.size();
    for (size_t k = 0; k <= options.terms; ++k)
      result.errors.push_back(k <= result.terms ? errorOf(factors, k, observed) : result.errors.back());
    for (FactorTerm& term : factors.terms) term.view = inCells(matrix.cells, term.view, factors.channels);
    factors.cells = matrix.cells.size();
    store.put(factors, rows, vertices[i]);
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
  report.resampledBytes = resampledBytes(views.mesh().triangles.size(), patch.samples(), grid.cells());
  report.normalizedBytes = normalizedBytes(triangleViews, patch.samples());
  return std::move(store).maps(report.white);
}

} // namespace surflect::lfm
