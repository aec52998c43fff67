#include "render/lightfield/olf/opacity_map_build.h"

#include "render/lightfield/lfm/factorization.h"
#include "render/lightfield/lfm/map_shape.h"
#include "render/lightfield/lfm/maps.h"
#include "render/lightfield/lfm/vertex_matrix.h"
#include "render/lightfield/lfm/view_blend.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "render/lightfield/olf/packing.h"
#include "render/lightfield/olf/reference.h"
#include "srf/image/half_float.h"
#include "srf/image/image.h"
#include "surfel/base/error.h"
#include "surfel/base/time.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>
#include <span>
#include <utility>

namespace surflect::olf {

namespace {

using Views = std::vector<uint32_t>;

// A surface point of a row.
Vec3<double> pointOf(const Resampling& resampling, const lfm::RingRows& rows, uint32_t vertex, size_t row) {
  const auto& [ringTriangle, sample] = rows.of(row)[0];
  const uint32_t triangle = resampling.rings.around(vertex)[ringTriangle].triangle;
  const Vec3<double> weights = resampling.patch.barycentrics(sample);
  Vec3<double> point = Vec3<double>::Zero();
  for (size_t k = 0; k < 3; ++k)
    point += weights[static_cast<Eigen::Index>(k)] *
             resampling.field.mesh.positions[resampling.rings.corners()[triangle][k]].raw().cast<double>();
  return point;
}

Vec3<double> towards(const Resampling& resampling, uint32_t view, const Vec3<double>& point) {
  return (resampling.field.cameras[view].center().raw() - point).normalized();
}

std::vector<lfm::DiscPoint> sitesOf(const Resampling& resampling, const Views& views, uint32_t vertex,
                                    const Vec3<double>& point) {
  std::vector<lfm::DiscPoint> sites;
  for (const uint32_t view : views)
    sites.push_back(
        lfm::discPoint(resampling.frames[vertex], assume<lfm::Direction>(towards(resampling, view, point))));
  return sites;
}

Views viewsOf(const Resampling& resampling, uint32_t vertex) {
  const std::span<const uint32_t> visible = resampling.field.visible.of(vertex);
  const Vec3<double> p = resampling.field.mesh.positions[vertex].raw().cast<double>();
  Views above;
  for (const uint32_t view : visible)
    if (towards(resampling, view, p).dot(resampling.frames[vertex].z) > 0) above.push_back(view);
  return above.empty() ? Views(visible.begin(), visible.end()) : above;
}

// Texels of the views at a point; transparent behind a camera.
std::vector<Eigen::Vector4f> texelsOf(const OpacityField& field, const Views& views,
                                      const Vec3<double>& point) {
  std::vector<Eigen::Vector4f> texels;
  for (const uint32_t view : views) {
    const auto pixel = field.cameras[view].project(assume<Point3<AcquisitionSpace, double>>(point));
    texels.push_back(pixel ? Eigen::Vector4f(texelAt(field.packed, view, *pixel).cast<float>())
                           : Eigen::Vector4f(Eigen::Vector4f::Zero()));
  }
  return texels;
}

} // namespace

std::vector<lfm::VertexFrame> viewFrames(const OpacityField& field, const lfm::Rings& rings) {
  std::vector<lfm::VertexFrame> frames;
  for (uint32_t vertex = 0; vertex < field.mesh.positions.size(); ++vertex) {
    const Vec3<double> p = field.mesh.positions[vertex].raw().cast<double>();
    Vec3<double> sum = Vec3<double>::Zero();
    for (const uint32_t view : field.visible.of(vertex)) {
      const Vec3<double> towards = (field.cameras[view].center().raw() - p).normalized();
      if (std::ranges::any_of(rings.around(vertex), [&](const lfm::RingTriangle& around) {
            return areaVector(field.mesh, around.triangle).dot(towards) > 0;
          }))
        sum += towards;
    }
    frames.push_back(sum.norm() > 1e-6 ? lfm::frameAlong(sum) : rings.frame(vertex));
  }
  return frames;
}

lfm::LightFieldMatrix OpacityMatrix::view() const { return {rows, cells, values, weights, kMapChannels}; }

OpacityMatrix opacityMatrix(const Resampling& resampling, const lfm::RingRows& rows, uint32_t vertex,
                            const Progress& progress) {
  const lfm::ViewGrid& grid = resampling.grid;
  OpacityMatrix matrix{rows.rows(), grid.cells(), {}, {}};
  matrix.values.assign(kMapChannels * matrix.rows * matrix.cells, 0);
  matrix.weights.assign(matrix.rows * matrix.cells, 0);
  const Views views = viewsOf(resampling, vertex);
  if (views.empty()) return matrix;
  const Vec3<double> middle = resampling.field.mesh.positions[vertex].raw().cast<double>();
  const std::vector<lfm::DiscPoint> sitesOfVertex = sitesOf(resampling, views, vertex, middle);
  const lfm::SiteMesh shared = lfm::siteMesh(sitesOfVertex);
  const std::vector<lfm::CellBlend> blendsOfVertex = lfm::cellBlends(shared, sitesOfVertex, grid);
  const Eigen::Array4f scale(static_cast<float>(1 / resampling.white),
                             static_cast<float>(1 / resampling.white),
                             static_cast<float>(1 / resampling.white), 1);
  for (size_t row = 0; row < matrix.rows; ++row) {
    progress.checkpoint();
    const Vec3<double> point = pointOf(resampling, rows, vertex, row);
    const std::vector<lfm::DiscPoint> sites = sitesOf(resampling, views, vertex, point);
    const std::vector<lfm::CellBlend> blends =
        lfm::cellBlends(shared.holdsFor(sites) ? shared : lfm::siteMesh(sites), sites, grid);
    const std::vector<Eigen::Vector4f> texels = texelsOf(resampling.field, views, point);
    for (size_t cell = 0; cell < matrix.cells; ++cell) {
      Eigen::Array4f sum = Eigen::Array4f::Zero();
      for (size_t k = 0; k < 3; ++k) sum += blends[cell].weights[k] * texels[blends[cell].sites[k]].array();
      const Eigen::Array4f value = rows.hats[row] * (scale * sum).max(0.f).sqrt();
      std::copy_n(value.data(), kMapChannels, &matrix.values[kMapChannels * (row * matrix.cells + cell)]);
      matrix.weights[row * matrix.cells + cell] = blendsOfVertex[cell].isObserved && grid.isInDisc(cell);
    }
  }
  return matrix;
}

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
  field.packed = packViews(views, training, {.budget = kNoBudget}, packing, progress);
  return field;
}

// Mesh of the rings, whose vertices at one position are one.
TriangleMesh weldedMesh(const TriangleMesh& mesh, const lfm::Rings& rings) {
  TriangleMesh welded = mesh;
  welded.triangles.assign(rings.corners().begin(), rings.corners().end());
  return welded;
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
  requireMemoryFor(rings, {options.samples, options.viewSize, options.terms, kMapChannels});
  const std::vector<lfm::VertexFrame> frames = viewFrames(field, rings);
  const Resampling resampling{field, rings, frames, patch, grid, whiteLevel(field.packed.texels)};
  lfm::MapStore store(emptyMaps(weldedMesh(field.mesh, rings), frames, lfm::Factorization::pca,
                                options.samples, options.viewSize, options.terms, kMapChannels),
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
