// Geometry over the photographs that it must fit: outlines, and the same view of it as a white Lambert
// surface under the light that the capture states. A wrong axis, unit or light is seen at a glance.
#pragma once

#include "srf/capture/capture.h"
#include "srf/image/image.h"
#include "srf/image/image_file.h"
#include "srf/image/mask.h"
#include "srf/image/resize.h"
#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"

#include <optional>
#include <span>
#include <string>
#include <vector>

namespace surflect::evaluation {

// A mesh as a white Lambert surface. Faces that meet at less than 45 degrees are smooth.
class WhiteSurface {
public:
  explicit WhiteSurface(const TriangleMesh& mesh);

  struct Seen {
    Rgb radiance;
    bool isBack; // of a triangle
  };
  // What a ray meets: radiance irradiance / pi  max(0, n . l), none in the mesh's own shadow and none of
  // backs. Without a light the viewer, at `origin`, holds one of irradiance 1.
  std::optional<Seen> seen(const Point3<AcquisitionSpace, double>& origin,
                           const Direction3<AcquisitionSpace, double>& direction,
                           const capture::Light* light) const;

  const RayCaster<AcquisitionSpace>& rays() const { return rays_; }

private:
  RayCaster<AcquisitionSpace> rays_;
  std::vector<Vec3<float>> faceNormals_;   // unit
  std::vector<Vec3<float>> cornerNormals_; // unit, three a triangle
};

// How a view is shown, whatever the light.
struct OverlayView {
  capture::Camera<AcquisitionSpace> camera;
  image::Mask silhouette;    // of the geometry, in pixels of the photograph
  image::PixelWindow window; // of the photograph, that is shown
  image::PictureSize size;   // of the pictures
};

// One photograph with the geometry. All images have the view's size.
struct Overlay {
  std::string camera, light;     // identities; no light: fixed illumination, the viewer holds the light
  image::Image photograph;       // RGB radiance
  image::Image geometry;         // RGBA radiance of the white surface, premultiplied
  image::Image geometryOutline;  // the share of each pixel that a line along its silhouette covers
  image::Image maskOutline;      // the same of the mask; empty where there is none
  std::optional<double> maskIou; // of mask and silhouette
  double shadingCorrelation = 0; // of the lumas of photograph and white surface, where both show the object
  double backShare = 0;          // how much of the geometry seen shows its back: a mesh inside out
};

// radiance: 3 channels; mask: 1, or null where there is none; light: null where illumination is fixed. Cost:
// 9 rays and as many shadow rays a pixel of the pictures. Names are left to the caller.
Overlay overlayOf(const OverlayView& view, const capture::Light* light, const image::Image& radiance,
                  const image::Image* mask, const WhiteSurface& surface, const Progress& progress);

// Pearson's correlation; 0 where one is constant or there are no values. Both of one length.
double correlation(std::span<const double> a, std::span<const double> b);

} // namespace surflect::evaluation
