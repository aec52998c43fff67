#include "render/lightfield/lumigraph/build.h"

#include "render/lightfield/common/pull_push.h"
#include "render/lightfield/lumigraph/depth_geometry.h"
#include "render/lightfield/lumigraph/lumigraph_file.h"
#include "render/lightfield/lumigraph/slab.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/base/memory.h"
#include "surfel/base/time.h"

#include <Eigen/Core>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect::lumigraph {

namespace {

// Sums of one picture, to be added in order.
struct Sums {
  size_t lines = 0;
  double depth = 0, worstDepth = 0, offset = 0, worstOffset = 0;
};

Sums sumsOf(const Slab& slab, int i, int j, const RayCaster<AcquisitionSpace>& object,
            const RayCaster<AcquisitionSpace>& geometry, int step) {
  Sums sums;
  const double p = std::abs(slab.stPlane - slab.uvPlane);
  const double s = std::max(slab.stSpacing[0], slab.stSpacing[1]);
  for (int row = step / 2; row < slab.height; row += step)
    for (int column = step / 2; column < slab.width; column += step) {
      const Line line =
          slab.lineOf({static_cast<double>(i), static_cast<double>(j), column + 0.5, row + 0.5});
      const auto truth = object.firstHit(line.origin, line.direction),
                 found = geometry.firstHit(line.origin, line.direction);
      if (!truth || !found) continue;
      const double slant = std::abs(line.direction.raw()[slab.axis]); // depth along the line, per length
      const double d = truth->distance * slant, e = found->distance * slant - d;
      const double offset = std::abs(ghostOffset(p, e, s, d, slab.uvSpacing));
      ++sums.lines;
      sums.depth += std::abs(e), sums.worstDepth = std::max(sums.worstDepth, std::abs(e));
      sums.offset += offset, sums.worstOffset = std::max(sums.worstOffset, offset);
    }
  return sums;
}

} // namespace

DepthErrors depthErrors(const Slabs& slabs, const RayCaster<AcquisitionSpace>& object,
                        const TriangleMesh& geometry, int step, const Progress& progress) {
  assert(step >= 1);
  const RayCaster<AcquisitionSpace> simplified(geometry, progress);
  const int nodes = slabs[0].nodes;
  const auto ofSlab = static_cast<size_t>(nodes * nodes);
  std::vector<Sums> pictures(kSlabs * ofSlab);
  tbb::parallel_for(size_t{0}, pictures.size(), [&](size_t picture) {
    progress.checkpoint();
    const auto node = static_cast<int>(picture % ofSlab);
    pictures[picture] = sumsOf(slabs[picture / ofSlab], node % nodes, node / nodes, object, simplified, step);
  });
  DepthErrors errors;
  for (const Sums& sums : pictures) {
    errors.lines += sums.lines;
    errors.meanDepth += sums.depth, errors.meanOffset += sums.offset;
    errors.worstDepth = std::max(errors.worstDepth, sums.worstDepth);
    errors.worstOffset = std::max(errors.worstOffset, sums.worstOffset);
  }
  const auto lines = static_cast<double>(std::max<size_t>(1, errors.lines));
  errors.meanDepth /= lines, errors.meanOffset /= lines;
  return errors;
}

std::vector<Texel> Resampler::picture(const Slab& slab, int i, int j, Tally& tally,
                                      const Progress& progress) const {
  std::vector<Eigen::Vector4f> colors(slab.nodeTexels());
  std::vector<Sample::Kind> kinds(slab.nodeTexels());
  tbb::parallel_for(0, slab.height, [&](int row) {
    progress.checkpoint();
    for (int column = 0; column < slab.width; ++column) {
      const Sample sample =
          at(slab.lineOf({static_cast<double>(i), static_cast<double>(j), column + 0.5, row + 0.5}));
      const size_t texel = static_cast<size_t>(row) * slab.width + column;
      kinds[texel] = sample.kind;
      colors[texel] << sample.color, sample.kind == Sample::Kind::seen ? 1.f : 0.f;
    }
  });
  lightfield::pullPush(colors, slab.width, slab.height);
  std::vector<Texel> texels(slab.nodeTexels());
  for (size_t texel = 0; texel < texels.size(); ++texel) {
    for (int channel = 0; channel < 3; ++channel)
      texels[texel][channel] = image::finiteHalf(colors[texel][channel]);
    texels[texel][3] = image::nearestHalf(kinds[texel] == Sample::Kind::missed ? 0.f : 1.f);
  }
  tally.seen += std::ranges::count(kinds, Sample::Kind::seen);
  tally.unseen += std::ranges::count(kinds, Sample::Kind::unseen);
  tally.missed += std::ranges::count(kinds, Sample::Kind::missed);
  return texels;
}

namespace {

// Lines along which the errors of depth are measured, about.
constexpr double kErrorLines = 1e6;

// Step between texels, in rows and columns, that leaves about this many lines.
int stepFor(const Slabs& slabs, double lines) {
  double texels = 0;
  for (const Slab& slab : slabs) texels += static_cast<double>(slab.texels());
  return static_cast<int>(std::ceil(std::sqrt(texels / lines)));
}

// Throws Error unless all texels fit on the disk, and into memory, where a lumigraph is rendered from.
void requireRoom(const Slabs& slabs, const SlabOptions& options, const std::filesystem::path& folder) {
  double bytes = 0;
  for (const Slab& slab : slabs) bytes += static_cast<double>(slab.texels() * sizeof(Texel));
  atField(fmt::format("texels {} and st {}", options.texels, options.nodes), [&] {
    lightfield::requireDisk(folder, bytes, "the pictures of six slabs");
    requireMemory(bytes, "the pictures of six slabs, when they are rendered");
  });
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
  requireRoom(report.slabs, options.slabs, folder);
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
