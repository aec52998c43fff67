#include "render/lightfield/olf/build.h"

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/olf/opacity_file.h"
#include "render/lightfield/olf/opacity_hull.h"
#include "render/lightfield/olf/triangle_blends.h"
#include "surfel/base/time.h"

#include <vector>

namespace surflect::olf {

BuildReport build(lightfield::Views& views, const BuildOptions& options, const std::filesystem::path& folder,
                  const Progress& progress) {
  BuildReport report;
  Stopwatch stopwatch;
  const auto lap = [&](const char* step) {
    report.seconds[step] = stopwatch.seconds();
    stopwatch = {};
  };
  report.isHull = replaceMesh(views, {options.hull, options.triangles}, progress);
  lap("mesh");
  OpacityField field;
  field.method = options.method, field.domain = options.domain;
  field.order = options.order;
  field.mesh = views.mesh();
  const std::vector<size_t> training = views.ofSplit(capture::Split::train);
  const lfm::Rings rings(field.mesh, progress);
  field.visible =
      visibleViews(views, training, rings,
                   options.visible.value_or(report.isHull ? Visible::all : Visible::ring), progress);
  if (field.method == Blending::vdtm) requireTriangulable(field.visible);
  lap("visibility");
  PackingReport packing;
  field.packed = packViews(views, training, options.packing, packing, progress);
  lap("views");
  writeField(field, views.capture(), folder, progress);
  report.triangles = field.mesh.triangles.size();
  report.vertices = rings.vertices().size();
  report.views = training.size();
  report.unseenVertices = field.visible.unseenVertices;
  report.visibleViews =
      static_cast<double>(field.visible.views.size()) / static_cast<double>(rings.vertices().size());
  report.width = field.packed.width, report.height = field.packed.height;
  report.scale = packing.scale, report.cutOffShare = packing.cutOffShare,
  report.pictureBytes = packing.pictureBytes;
  report.s3tc = options.packing.s3tc;
  report.packedBytes = field.packed.bytes();
  report.bytes = lightfield::LightFieldFolder(folder, kFormat, kVersion, progress).bytes();
  lap("write");
  return report;
}

} // namespace surflect::olf
