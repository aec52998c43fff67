#include "render/lightfield/olf/opacity_map_build.h"

#include "render/lightfield/lfm/factorization.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/map_store.h"
#include "render/lightfield/lfm/resolution.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "render/lightfield/olf/opacity_matrix.h"
#include "render/lightfield/olf/packing.h"
#include "surfel/base/error.h"
#include "surfel/base/stopwatch.h"

#include <tbb/parallel_for.h>

#include <mutex>
#include <span>
#include <utility>

namespace surflect::olf {

namespace {

// A field of the views at full size.
OpacityField fieldOf(const lightfield::Views& views, const lfm::Rings& rings, Visible visible,
                     const Progress& progress) {
  constexpr size_t kNoBudget = size_t{1} << 50;
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  OpacityField field;
  field.mesh = views.mesh();
  for (const size_t view : training) field.cameras.push_back(views.camera(view));
  field.visible = visibleViews(views, training, rings, visible, progress);
  PackingReport packing;
  field.packed = packViews(views, training, kNoBudget, packing, progress);
  return field;
}

// Mesh of the rings, whose vertices at one position are one.
TriangleMesh weldedMesh(const TriangleMesh& mesh, const lfm::Rings& rings) {
  TriangleMesh welded = mesh;
  welded.triangles.assign(rings.corners().begin(), rings.corners().end());
  return welded;
}

std::vector<lfm::VertexFrame> framesOf(const lfm::Rings& rings, size_t vertices) {
  std::vector<lfm::VertexFrame> frames;
  for (uint32_t v = 0; v < vertices; ++v) frames.push_back(rings.frame(v));
  return frames;
}

struct VertexReport {
  std::vector<lfm::FactorError> errors; // after 0, 1, ... terms
  size_t terms = 0;
  double matrixSeconds = 0, factorSeconds = 0;
};

std::vector<lfm::FactorError> errorsOf(const lfm::Factors& factors, const lfm::LightFieldMatrix& matrix,
                                       size_t terms) {
  std::vector<lfm::FactorError> errors;
  for (size_t k = 0; k <= terms; ++k)
    errors.push_back(k <= factors.terms.size() ? errorOf(factors, k, matrix) : errors.back());
  return errors;
}

void add(const VertexReport& vertex, MapBuildReport& report) {
  for (size_t k = 0; k < vertex.errors.size(); ++k) {
    report.errors[k].squares += vertex.errors[k].squares;
    report.errors[k].weight += vertex.errors[k].weight;
  }
  report.meanTerms += static_cast<double>(vertex.terms) / static_cast<double>(report.vertices);
  report.seconds["matrices"] += vertex.matrixSeconds, report.seconds["factors"] += vertex.factorSeconds;
}

} // namespace

OpacityMaps mapsOf(const OpacityField& field, const lfm::Rings& rings, const MapBuildOptions& options,
                   MapBuildReport& report, const Progress& progress) {
  if (options.terms > lfm::kMostTerms)
    throw Error::mismatch("0.." + std::to_string(lfm::kMostTerms), std::to_string(options.terms)).at("terms");
  const lfm::PatchGrid patch(options.samples);
  const lfm::ViewGrid grid(options.viewSize);
  const Resampling resampling{field, rings, patch, grid, whiteLevel(field.packed)};
  lfm::MapStore store(emptyMaps(weldedMesh(field.mesh, rings), framesOf(rings, field.mesh.positions.size()),
                                lfm::Method::pca, options.samples, options.viewSize, options.terms,
                                kMapChannels),
                      rings);
  const std::span<const uint32_t> vertices = rings.vertices();
  std::vector<VertexReport> reports(vertices.size());
  const Progress quiet{{}, progress.cancelled};
  std::mutex reporting;
  size_t done = 0;
  tbb::parallel_for(size_t{0}, vertices.size(), [&](size_t i) {
    Stopwatch watch;
    const lfm::RingRows rows = lfm::ringRows(rings, vertices[i], patch);
    const OpacityMatrix matrix = opacityMatrix(resampling, rows, vertices[i], quiet);
    reports[i].matrixSeconds = watch.seconds();
    watch = {};
    const lfm::Factors factors = lfm::factorized(matrix.view(), {.terms = options.terms}, quiet);
    store.put(factors, rows, vertices[i]);
    reports[i].errors = errorsOf(factors, matrix.view(), options.terms);
    reports[i].terms = factors.terms.size();
    reports[i].factorSeconds = watch.seconds();
    const std::scoped_lock lock(reporting);
    progress("factorise", static_cast<double>(++done) / static_cast<double>(vertices.size()));
  });
  report.triangles = field.mesh.triangles.size(), report.vertices = vertices.size();
  report.views = field.cameras.size(), report.samples = options.samples, report.white = resampling.white;
  report.errors.resize(options.terms + 1);
  for (const VertexReport& vertex : reports) add(vertex, report);
  report.resampledBytes = lfm::resampledBytes(report.triangles, patch.samples(), grid.cells(), kMapChannels);
  return {std::move(store).maps(1), report.white, options.order};
}

OpacityMaps buildMaps(lightfield::Views& views, MapBuildOptions options, MapBuildReport& report,
                      const Progress& progress) {
  Stopwatch stopwatch;
  report = {};
  report.isHull = replaceMesh(views, options.mesh, progress);
  options.samples = lfm::samplesFor(views, options.samples);
  const lfm::Rings rings(views.mesh(), progress);
  report.seconds["mesh"] = stopwatch.seconds();
  stopwatch = {};
  const OpacityField field =
      fieldOf(views, rings, options.visible.value_or(report.isHull ? Visible::all : Visible::ring), progress);
  report.seconds["views"] = stopwatch.seconds();
  return mapsOf(field, rings, options, report, progress);
}

} // namespace surflect::olf
