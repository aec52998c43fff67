#include "render/lightfield/lumigraph/build.h"

#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "surfel/base/stopwatch.h"
#include "surfel/geometry/simplify.h"

namespace surflect::lumigraph {

BuildReport build(const lightfield::Views& views, const BuildOptions& options,
                  const std::filesystem::path& folder, const Progress& progress) {
  BuildReport report;
  Stopwatch stopwatch;
  const auto lap = [&](const char* step) {
    report.seconds[step] = stopwatch.seconds();
    stopwatch = {};
  };
  const TriangleMesh& mesh = views.mesh();
  report.slabs = slabsAround(mesh, options.slabs);
  report.triangles =
      options.triangles == 0 ? mesh.triangles.size() : simplified(mesh, options.triangles).triangles.size();
  lap("slabs");
  const Resampler resampler(views, options.resampling, progress);
  lap("photographs");
  LumigraphWriter writer(folder);
  const size_t nodes = static_cast<size_t>(options.slabs.nodes) * static_cast<size_t>(options.slabs.nodes);
  size_t done = 0;
  for (const Slab& slab : report.slabs)
    for (int j = 0; j < slab.nodes; ++j)
      for (int i = 0; i < slab.nodes; ++i) {
        writer.append(resampler.picture(slab, i, j, report.texels, progress));
        progress("resample", static_cast<double>(++done) / static_cast<double>(kSlabs * nodes));
      }
  lap("resample");
  writer.commit(views.capture(), mesh, {options.slabs, options.triangles}, progress);
  report.bytes = lightfield::LightFieldFolder(folder, kFormat, kVersion, progress).bytes();
  lap("write");
  return report;
}

} // namespace surflect::lumigraph
