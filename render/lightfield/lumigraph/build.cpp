#include "render/lightfield/lumigraph/build.h"

#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/lumigraph.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "surfel/base/stopwatch.h"

#include <cmath>

namespace surflect::lumigraph {

namespace {

// Lines along which the errors of depth are measured, about.
constexpr double kErrorLines = 1e6;

// Step between texels, in rows and columns, that leaves about this many lines.
int stepFor(const Slabs& slabs, double lines) {
  double texels = 0;
  for (const Slab& slab : slabs) texels += static_cast<double>(slab.texels());
  return static_cast<int>(std::ceil(std::sqrt(texels / lines)));
}

} // namespace

BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const std::filesystem::path& folder, const Progress& progress) {
  BuildReport report;
  Stopwatch stopwatch;
  const auto lap = [&](const char* step) {
    report.seconds[step] = stopwatch.seconds();
    stopwatch = {};
  };
  const TriangleMesh& mesh = views.mesh();
  Lumigraph lumigraph;
  lumigraph.slabs = report.slabs = slabsAround(mesh, options.slabs);
  lumigraph.overlap = options.slabs.overlap;
  lumigraph.geometry = depthGeometry(mesh, options.triangles);
  report.triangles = lumigraph.geometry.mesh.triangles.size();
  if (!lumigraph.geometry.exactOutline)
    report.errors = depthErrors(report.slabs, views.rays(), lumigraph.geometry.mesh,
                                stepFor(report.slabs, kErrorLines), progress);
  lap("slabs");
  const Resampler resampler(views, options.resampling, progress);
  lap("photographs");
  LumigraphWriter writer(folder);
  const size_t nodes = static_cast<size_t>(options.slabs.nodes) * static_cast<size_t>(options.slabs.nodes);
  size_t done = 0;
  for (const Slab& slab : report.slabs)
    for (int j = 0; j < slab.nodes; ++j)
      for (int i = 0; i < slab.nodes; ++i) {
        const Tally before = report.texels;
        writer.append(resampler.picture(slab, i, j, report.texels, progress));
        if (report.texels.seen == before.seen && report.texels.unseen > before.unseen) ++report.blackPictures;
        progress("resample", static_cast<double>(++done) / static_cast<double>(kSlabs * nodes));
      }
  lap("resample");
  writer.commit(views.capture(), mesh, lumigraph, progress);
  report.bytes = lightfield::LightFieldFolder(folder, kFormat, kVersion, progress).bytes();
  lap("write");
  return report;
}

} // namespace surflect::lumigraph
