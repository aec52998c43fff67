#include "render/lightfield/lfm/resolution.h"

#include "render/lightfield/common/pixel_footprint.h"
#include "render/lightfield/lfm/patch_grid.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/simplify.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect::lfm {

Resolution resolutionFor(const lightfield::Views& views, size_t triangles, int samples) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const size_t view : views.ofSplit(capture::Split::train)) cameras.push_back(views.camera(view));
  const TriangleMesh& mesh = views.mesh();
  const double pixel = lightfield::pixelFootprint(mesh, cameras);
  const double pixels = pixel > 0 ? surfaceArea(mesh) / (pixel * pixel) : 0;
  Resolution result;
  if (triangles > 0)
    result.mesh = simplified(mesh, triangles);
  else
    result.mesh =
        simplified(mesh, static_cast<size_t>(std::max(4., std::ceil(pixels / kPixelsPerTriangle))), pixel);
  const auto count = static_cast<double>(std::max<size_t>(1, result.mesh.triangles.size()));
  result.samples = samples > 0 ? samples : samplesPerEdgeFor(pixels / count);
  return result;
}

} // namespace surflect::lfm
