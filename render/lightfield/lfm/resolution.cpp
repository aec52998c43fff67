#include "render/lightfield/lfm/resolution.h"

#include "render/lightfield/common/pixel_footprint.h"
#include "render/lightfield/lfm/patch_grid.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/simplify.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace surflect::lfm {

namespace {

// Width of a pixel on the views' mesh, and the mesh's area in pixels.
struct MeshPixels {
  double width = 0, count = 0;
};

MeshPixels pixelsOf(const lightfield::Views& views) {
  std::vector<capture::Camera<AcquisitionSpace>> cameras;
  for (const size_t view : views.ofSplit(capture::Split::train)) cameras.push_back(views.camera(view));
  const double pixel = lightfield::pixelFootprint(views.mesh(), cameras);
  return {pixel, pixel > 0 ? surfaceArea(views.mesh()) / (pixel * pixel) : 0};
}

int samplesOf(int samples, double pixels, const TriangleMesh& mesh) {
  const auto count = static_cast<double>(std::max<size_t>(1, mesh.triangles.size()));
  return samples > 0 ? samples : samplesPerEdgeFor(pixels / count);
}

} // namespace

int samplesFor(const lightfield::Views& views, int samples) {
  return samplesOf(samples, pixelsOf(views).count, views.mesh());
}

Resolution resolutionFor(const lightfield::Views& views, size_t triangles, int samples) {
  const TriangleMesh& mesh = views.mesh();
  const auto [pixel, pixels] = pixelsOf(views);
  Resolution result;
  if (triangles > 0)
    result.mesh = simplified(mesh, triangles);
  else
    result.mesh =
        simplified(mesh, static_cast<size_t>(std::max(4., std::ceil(pixels / kPixelsPerTriangle))), pixel);
  result.samples = samplesOf(samples, pixels, result.mesh);
  return result;
}

} // namespace surflect::lfm
