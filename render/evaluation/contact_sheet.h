// Contact sheet: overlays of many photographs in one image.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/image/image_file.h"
#include "srf/image/mask.h"
#include "srf/image/resize.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/rgb.h"

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::evaluation {

// Overlay of geometry on the photographs that it must fit: outlines, and the same view of the geometry as a
// white Lambert surface under the stated light. Shows a wrong axis, unit or light at a glance.

// A mesh as a white Lambert surface, smooth across edges of less than 45 degrees.
class WhiteSurface {
public:
  explicit WhiteSurface(const TriangleMesh& mesh);

  struct Seen {
    Rgb radiance;
    bool isBack; // true for the back of a triangle
  };
  // First hit of a ray: radiance irradiance / pi  max(0, n . l), 0 in the mesh's own shadow and on backs.
  // Without a light, the viewer at `origin` holds one of irradiance 1.
  std::optional<Seen> seen(const Point3<AcquisitionSpace, double>& origin,
                           const Direction3<AcquisitionSpace, double>& direction,
                           const capture::Light* light) const;

  const RayCaster<AcquisitionSpace>& rays() const { return rays_; }

private:
  RayCaster<AcquisitionSpace> rays_;
  std::vector<Vec3<float>> faceNormals_;   // unit
  std::vector<Vec3<float>> cornerNormals_; // unit, three per triangle
};

// A view to be shown, independent of the light.
struct OverlayView {
  capture::Camera<AcquisitionSpace> camera;
  image::Mask silhouette;    // geometry, in photograph pixels
  image::PixelWindow window; // visible part of the photograph
  image::PictureSize size;   // size of the overlay's images
};

// One photograph with the geometry. All images have the view's size.
struct Overlay {
  std::string camera, light;    // identities; no light means fixed illumination, with the light at the viewer
  image::Image photograph;      // RGB radiance
  image::Image geometry;        // RGBA radiance of the white surface, premultiplied
  image::Image geometryOutline; // coverage of each pixel by a line along the geometry's silhouette
  image::Image maskOutline;     // as geometryOutline, for the mask; empty if there is none
  std::optional<double> maskIou; // intersection over union of mask and silhouette
  double shadingCorrelation = 0; // between lumas of photograph and white surface, inside both
  double backShare = 0; // fraction of the visible geometry that is back-facing; large for a mesh inside out
};

// Overlays the geometry on a photograph. radiance: 3 channels; mask: 1 channel, or null; light: null for
// fixed illumination. Costs 9 rays and 9 shadow rays per pixel. The caller fills in the names.
Overlay overlayOf(const OverlayView& view, const capture::Light* light, const image::Image& radiance,
                  const image::Image* mask, const WhiteSurface& surface, const Progress& progress);

// Pearson's correlation of two spans of equal length; 0 if they are empty or one is constant.
double correlation(std::span<const double> a, std::span<const double> b);

// Selects up to `count` frames, spread evenly over views and lights, in their order.
std::vector<size_t> spreadFrames(const capture::Capture& capture, size_t count);

// A whole photograph with the outlines of the geometry and of its mask, if it has one: three channels of sRGB
// values, in a picture of the given size. Throws Error and Cancelled.
image::Image outlinedPhotograph(const capture::Capture& capture, size_t frame, const WhiteSurface& surface,
                                image::PictureSize size, double exposure, const Progress& progress);

struct ContactSheet {
  image::Image image; // three channels of sRGB values; narrower than 4000 pixels
  std::vector<Overlay> overlays;
};

// Reads the photographs of at least one frame and draws a tile for each in the given order: a label above,
// the photograph with outlines on the left, the white surface on the right. Tiles are cropped to the
// surroundings of the geometry, unless it lies outside the photograph. All photographs share one exposure and
// all white surfaces another; each exposure maps the 99.5th percentile over the geometry to white. Throws
// Error and Cancelled.
ContactSheet contactSheet(const capture::Capture& capture, std::span<const size_t> frames,
                          const WhiteSurface& surface, const Progress& progress);

} // namespace surflect::evaluation
